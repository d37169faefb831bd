// SPDX-License-Identifier: MIT
// Draws the bodies of a scene.
using System.Collections.Generic;
using ClothStream.Core;
using UnityEngine;

namespace ClothStream
{
    /// <summary>
    /// Draws the bodies of the scene that participants can wear: each as a mesh under the connection, which follows its joints.
    /// The own body is drawn from the neck down, because its head would be before the camera.
    /// </summary>
    [AddComponentMenu("ClothStream/Streamed Bodies")]
    public sealed class StreamedBodies : MonoBehaviour
    {
        [Tooltip("Connection whose bodies are drawn. Empty: the one on this object or its parents.")]
        public ClothStreamConnection connection;
        [Tooltip("Material of the bodies.")]
        public Material material;

        readonly List<BodyMesh> bodies = new List<BodyMesh>();
        int descriptions;

        /// <summary>Mesh of a body, with as many indices as are drawn; null if the scene has no such body, or while this component
        /// is disabled.</summary>
        public Mesh MeshOf(string body)
        {
            BodyMesh found = bodies.Find(one => one.Name == body);
            return found == null ? null : found.Mesh;
        }

        void OnEnable()
        {
            if (connection == null) connection = GetComponentInParent<ClothStreamConnection>();
            descriptions = -1;
            if (connection != null) return;
            Debug.LogError("ClothStream: Streamed Bodies has no connection. Set it in the inspector.", this);
            enabled = false;
        }

        void LateUpdate()
        {
            Client client = connection.Client;
            if (client == null || connection.Descriptions == 0) return;
            lock (client.Gate)
            {
                if (descriptions != connection.Descriptions) Describe(client);
                string own = client.BodyOf(client.ParticipantId);
                foreach (BodyMesh body in bodies) body.Follow(client, body.Name == own);
            }
        }

        void OnDisable()
        {
            foreach (BodyMesh body in bodies) body.Destroy();
            bodies.Clear();
        }

        void Describe(Client client)
        {
            descriptions = connection.Descriptions;
            OnDisable();
            foreach (KeyValuePair<int, string> body in client.Bodies) bodies.Add(new BodyMesh(body.Key, body.Value, connection.transform, material));
        }
    }
}
