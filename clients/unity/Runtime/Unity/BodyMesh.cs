// SPDX-License-Identifier: MIT
// Mesh of one body of a scene.
using ClothStream.Core;
using Unity.Collections;
using UnityEngine;
using UnityEngine.Rendering;

namespace ClothStream
{
    // Vertices keep the coordinates of the stream, in the frame of the collider: see StreamedCloth.
    sealed unsafe class BodyMesh
    {
        static readonly VertexAttributeDescriptor[] Layout =
        {
            new VertexAttributeDescriptor(VertexAttribute.Position, VertexAttributeFormat.Float32, 3, 0),
            new VertexAttributeDescriptor(VertexAttribute.Normal, VertexAttributeFormat.Float32, 3, 1)
        };

        readonly int collider;
        readonly GameObject drawn;
        bool? isOwn;

        public readonly string Name;
        public readonly Mesh Mesh;

        public BodyMesh(int collider, string name, Transform parent, Material material)
        {
            this.collider = collider;
            Name = name;
            Mesh = new Mesh { name = name };
            Mesh.MarkDynamic();
            drawn = new GameObject(name, typeof(MeshFilter), typeof(MeshRenderer));
            drawn.transform.SetParent(parent, false);
            drawn.transform.localScale = new Vector3(1, 1, -1);
            drawn.GetComponent<MeshFilter>().sharedMesh = Mesh;
            drawn.GetComponent<MeshRenderer>().sharedMaterials = new[] { material };
        }

        public void Destroy()
        {
            Object.Destroy(drawn);
            Object.Destroy(Mesh);
        }

        // Hold the gate of the client. `own`: this participant wears it, so that what is above the neck is left out.
        public void Follow(Client client, bool own)
        {
            Collider shown;
            if (!client.TryGetShownCollider(collider, out shown)) return;
            drawn.transform.localPosition = new Vector3(shown.position[0], shown.position[1], -shown.position[2]);
            drawn.transform.localRotation = new Quaternion(-shown.orientation[0], -shown.orientation[1], shown.orientation[2], shown.orientation[3]);
            uint vertices, corners;
            uint* triangles;
            float* positions = Native.cs_get_hull(client.Handle, (uint)collider, &vertices, &triangles, &corners);
            if (positions == null) return;
            if (Mesh.vertexCount != vertices) isOwn = null;
            if (isOwn != own)
            {
                isOwn = own;
                if (own) triangles = Native.cs_body_below_neck(client.Handle, (uint)collider, &corners);
                Mesh.Clear();
                Mesh.SetVertexBufferParams((int)vertices, Layout);
                Mesh.SetIndexBufferParams((int)corners, IndexFormat.UInt32);
                Mesh.SetIndexBufferData(StreamedCloth.View<uint>(triangles, (int)corners), 0, 0, (int)corners, StreamedCloth.Unchecked);
                Mesh.subMeshCount = 1;
                Mesh.SetSubMesh(0, new SubMeshDescriptor(0, (int)corners));
                // Memory of the core is valid until the next call.
                positions = Native.cs_get_hull(client.Handle, (uint)collider, &vertices, &triangles, &corners);
            }
            NativeArray<Vector3> places = StreamedCloth.View<Vector3>(positions, (int)vertices);
            Mesh.SetVertexBufferData(places, 0, 0, (int)vertices, 0, StreamedCloth.Unchecked);
            Mesh.RecalculateNormals();
            Mesh.RecalculateBounds();
        }
    }
}
