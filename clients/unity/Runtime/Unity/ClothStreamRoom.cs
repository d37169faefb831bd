// SPDX-License-Identifier: MIT
// Lets cloth lie on surfaces of the real room.
using System.Collections.Generic;
using ClothStream.Core;
using UnityEngine;

namespace ClothStream
{
    /// <summary>
    /// Sends the meshes below an object to the server as surfaces of the real room: cloth lies on them, and does not pass
    /// through. AR Foundation puts them there: the trackables of an ARPlaneManager whose prefab has an ARPlaneMeshVisualizer,
    /// or the meshes of an ARMeshManager. Changes are sent at most twice per second. Meshes that vanish are removed, and all of
    /// them when this component is disabled.
    /// </summary>
    [AddComponentMenu("ClothStream/ClothStream Room")]
    public sealed class ClothStreamRoom : MonoBehaviour
    {
        const ulong PeriodUs = 500000;

        [Tooltip("Connection whose cloth lies on the room. Empty: the one on this object or its parents.")]
        public ClothStreamConnection connection;
        [Tooltip("Object below which the meshes of the room are, such as the Trackables of the XR Origin.")]
        public Transform meshes;
        [Tooltip("Who gets the shape of the user's room. It is private: ask the user before you change it from No One, and say who receives it.")]
        public RoomSharing share = RoomSharing.NoOne;
        [Tooltip("Cloth can be on both sides of a mesh. Off: it passes a mesh from behind, which suits floors, tables and scans of a room.")]
        public bool twoSided;
        [Tooltip("Coefficient of friction, multiplied with the cloth's.")]
        [Range(0, 10)]
        public float friction = 1;

        readonly Dictionary<MeshFilter, RoomMesh> known = new Dictionary<MeshFilter, RoomMesh>();
        readonly List<MeshFilter> found = new List<MeshFilter>(), gone = new List<MeshFilter>();
        Client client;
        ulong readUs;
        uint newest;
        bool hasWarned;

        /// <summary>Number of surfaces that the server has been sent.</summary>
        public int Count { get { return known.Count; } }

        void OnEnable()
        {
            if (connection == null) connection = GetComponentInParent<ClothStreamConnection>();
            if (connection != null && meshes != null) return;
            string missing = connection == null ? "connection" : "object with meshes";
            Debug.LogError("ClothStream: ClothStream Room has no " + missing + ". Set it in the inspector.", this);
            enabled = false;
        }

        void Update()
        {
            if (!connection.IsJoined || Client.NowUs - readUs < PeriodUs) return;
            readUs = Client.NowUs;
            if (client != connection.Client)
                foreach (RoomMesh mesh in known.Values) mesh.Forget();
            client = connection.Client;
            SurfacePolicy policy = client.SurfacePolicy;
            if (!IsAllowed(policy))
            {
                Warn(share != RoomSharing.NoOne, policy == SurfacePolicy.Everyone ? "sends the shape of the real room to everyone in the scene, which the user has not agreed to."
                                                                                  : "takes no surfaces of the real room, so that cloth passes through them.");
                TakeBack();
                client.AllowSurfaces(SurfacePolicy.Own);
                return;
            }
            if (policy == SurfacePolicy.Everyone) client.AllowSurfaces(policy);
            meshes.GetComponentsInChildren(found);
            foreach (RoomMesh mesh in known.Values) mesh.IsPresent = false;
            bool takesAll = true;
            foreach (MeshFilter filter in found)
            {
                RoomMesh mesh;
                if (!known.TryGetValue(filter, out mesh)) known.Add(filter, mesh = new RoomMesh(++newest));
                mesh.IsPresent = true;
                takesAll &= mesh.Send(client, connection, filter, twoSided, friction);
            }
            Warn(!takesAll, "takes at most " + Native.CS_MAX_SURFACE_TRIANGLES + " triangles of a mesh of the real room. Larger ones are left out.");
            RemoveThoseThatAreGone();
        }

        void OnDisable()
        {
            if (connection == null || client != connection.Client) known.Clear();
            else TakeBack();
        }

        bool IsAllowed(SurfacePolicy policy)
        {
            return policy == SurfacePolicy.Own ? share != RoomSharing.NoOne : policy == SurfacePolicy.Everyone && share == RoomSharing.Everyone;
        }

        void RemoveThoseThatAreGone()
        {
            gone.Clear();
            foreach (KeyValuePair<MeshFilter, RoomMesh> one in known)
                if (!one.Value.IsPresent) gone.Add(one.Key);
            foreach (MeshFilter filter in gone)
            {
                known[filter].Remove(client);
                known.Remove(filter);
            }
        }

        void TakeBack()
        {
            if (client != null)
                foreach (RoomMesh mesh in known.Values) mesh.Remove(client);
            known.Clear();
        }

        // Says once what is missing.
        void Warn(bool holds, string what)
        {
            if (holds && !hasWarned) Debug.LogWarning("ClothStream: The server " + what, this);
            hasWarned = holds;
        }
    }
}
