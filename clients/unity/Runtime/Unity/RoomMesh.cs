// SPDX-License-Identifier: MIT
// A mesh of the real room in the coordinates of the stream, as the server has it.
using System.Collections.Generic;
using ClothStream.Core;
using UnityEngine;

namespace ClothStream
{
    // Reads a MeshFilter, and notes what has changed since the mesh was sent.
    sealed class RoomMesh
    {
        // Changes of a pose that are the noise of tracking: 1 mm, and 1 mm at 2 m.
        const float SamePlace = 1e-3f, SameTurn = 2.5e-4f;

        static readonly List<Vector3> vertices = new List<Vector3>();
        static readonly List<int> corners = new List<int>(), part = new List<int>();

        readonly StreamPose pose = new StreamPose();
        float[] positions = new float[0];
        uint[] triangles = new uint[0];
        bool isSent, wasRefused;

        public readonly uint Id;
        // Whether the filter was there in the newest reading.
        public bool IsPresent;

        public RoomMesh(uint id)
        {
            Id = id;
        }

        // Sends what has changed. Returns false if the server does not take the mesh.
        public bool Send(Client client, ClothStreamConnection connection, MeshFilter filter, bool twoSided, float friction)
        {
            bool hasMoved = ReadPose(connection, filter.transform), hasChanged = ReadMesh(filter.sharedMesh, RelativeScale(connection, filter.transform));
            if (hasChanged) wasRefused = false;
            if (wasRefused || triangles.Length == 0)
            {
                Remove(client);
                return !wasRefused;
            }
            if (isSent && !hasChanged) return !hasMoved || client.MoveSurface(Id, pose.Position, pose.Orientation);
            isSent = client.SetSurface(Id, positions, triangles, pose.Position, pose.Orientation, twoSided, friction);
            wasRefused = !isSent;
            return isSent;
        }

        public void Remove(Client client)
        {
            if (isSent) client.RemoveSurface(Id);
            isSent = false;
        }

        // A new client has no surfaces.
        public void Forget()
        {
            isSent = wasRefused = false;
        }

        // Returns whether the pose has changed.
        bool ReadPose(ClothStreamConnection connection, Transform transform)
        {
            float[] position = pose.Position, orientation = pose.Orientation;
            Vector3 at = connection.ToStream(transform.position);
            Quaternion turned = connection.ToStream(transform.rotation);
            float away = Mathf.Max(Mathf.Max(Mathf.Abs(at.x - position[0]), Mathf.Abs(at.y - position[1])), Mathf.Abs(at.z - position[2]));
            // q and -q are the same rotation.
            float along = turned.x * orientation[0] + turned.y * orientation[1] + turned.z * orientation[2] + turned.w * orientation[3];
            float sign = along < 0 ? -1 : 1;
            float turn = Mathf.Max(Mathf.Max(Mathf.Abs(sign * turned.x - orientation[0]), Mathf.Abs(sign * turned.y - orientation[1])),
                                   Mathf.Max(Mathf.Abs(sign * turned.z - orientation[2]), Mathf.Abs(sign * turned.w - orientation[3])));
            if (isSent && away < SamePlace && turn < SameTurn) return false;
            pose.Set(at, turned);
            return true;
        }

        static Vector3 RelativeScale(ClothStreamConnection connection, Transform transform)
        {
            Vector3 own = transform.lossyScale, stream = connection.transform.lossyScale;
            return new Vector3(own.x / stream.x, own.y / stream.y, own.z / stream.z);
        }

        // Returns whether the mesh has changed.
        bool ReadMesh(Mesh mesh, Vector3 scale)
        {
            vertices.Clear();
            corners.Clear();
            if (mesh != null && mesh.isReadable)
            {
                mesh.GetVertices(vertices);
                for (int i = 0; i < mesh.subMeshCount; ++i)
                {
                    mesh.GetTriangles(part, i);
                    corners.AddRange(part);
                }
            }
            bool hasChanged = 3 * vertices.Count != positions.Length || corners.Count != triangles.Length;
            if (hasChanged)
            {
                positions = new float[3 * vertices.Count];
                triangles = new uint[corners.Count];
            }
            // z changes its sign, so Unity's clockwise fronts are kept by turning each triangle round.
            for (int i = 0; i < vertices.Count; ++i)
            {
                Vector3 vertex = vertices[i];
                hasChanged |= Store(positions, 3 * i, vertex.x * scale.x) | Store(positions, 3 * i + 1, vertex.y * scale.y) | Store(positions, 3 * i + 2, -vertex.z * scale.z);
            }
            for (int i = 0; i < corners.Count; i += 3)
                hasChanged |= Store(triangles, i, corners[i]) | Store(triangles, i + 1, corners[i + 2]) | Store(triangles, i + 2, corners[i + 1]);
            return hasChanged;
        }

        static bool Store(float[] numbers, int index, float value)
        {
            if (numbers[index] == value) return false;
            numbers[index] = value;
            return true;
        }

        static bool Store(uint[] numbers, int index, int value)
        {
            if (numbers[index] == (uint)value) return false;
            numbers[index] = (uint)value;
            return true;
        }
    }
}
