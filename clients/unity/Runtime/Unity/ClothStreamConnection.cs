// SPDX-License-Identifier: MIT
// Joins a scene of a server while it is enabled.
using System;
using ClothStream.Core;
using UnityEngine;

namespace ClothStream
{
    /// <summary>
    /// Joins a scene of a clothstream-server, and stays in it while enabled. The transform of this object is the origin of the
    /// stream. The stream is right-handed and Unity is left-handed, so z changes its sign: see ToStream and FromStream.
    /// </summary>
    [AddComponentMenu("ClothStream/ClothStream Connection")]
    [DefaultExecutionOrder(-100)]
    public sealed class ClothStreamConnection : MonoBehaviour
    {
        [Tooltip("HOST or HOST:PORT of the server's page. wss:// before it means TLS. The default port is 8080.")]
        public string address = "127.0.0.1:8080";
        [Tooltip("Name of the scene. Empty: the server's default scene.")]
        public string scene = "";
        [Tooltip("Name that other participants see. May be empty.")]
        public string displayName = "";
        [Tooltip("Requested role. Unspecified: the server chooses. A viewer only watches.")]
        public Role role = Role.Unspecified;
        [Tooltip("Token for a server that requires one. Builds contain it, so set it in a script before this component is enabled. Sent to other machines only with TLS.")]
        public string token = "";
        [Tooltip("Code of six digits for a server with pairing. The server answers with a token: keep it, and set it in place of the code next time. See Paired.")]
        public string pairingCode = "";
        [Tooltip("With TLS: fingerprint of the server's key, 64 hexadecimal digits, as a server with --tls self prints it. Empty: an authority must have signed its certificate.")]
        public string fingerprint = "";
        [Tooltip("Smooth motion although frames arrive unevenly. Off: the newest frame is shown.")]
        public bool playOut = true;
        [Tooltip("Delay of play-out in milliseconds, 0 to 10000. Negative: adaptive.")]
        public float delayMs = -1;
        [Tooltip("Keeps the shown cloth out of the own hands while the server's answer is under way. Needs play-out.")]
        public bool localContact = true;
        [Tooltip("Best quality level: 0 (finest) to 3.")]
        [Range(0, 3)]
        public int quality;

        string logged = "";

        /// <summary>null while this component is disabled.</summary>
        public Client Client { get; private set; }
        /// <summary>Number of descriptions of the scene so far. Cloths, vertex counts and triangles change with it.</summary>
        public int Descriptions { get; private set; }
        /// <summary>Whether cloth arrives now.</summary>
        public bool IsJoined { get { return Client != null && Client.State == State.Joined; } }
        /// <summary>Raised in Update with what has changed since the frame before.</summary>
        public event Action<Events> Changed;
        /// <summary>Raised with the token that the server has given for the pairing code. Keep it secret.</summary>
        public event Action<string> Paired;

        /// <summary>Point of the stream for a point in the world.</summary>
        public Vector3 ToStream(Vector3 world)
        {
            return Mirror(transform.InverseTransformPoint(world));
        }

        /// <summary>Point in the world for a point of the stream.</summary>
        public Vector3 FromStream(Vector3 point)
        {
            return transform.TransformPoint(Mirror(point));
        }

        /// <summary>Rotation of the stream for a rotation in the world.</summary>
        public Quaternion ToStream(Quaternion world)
        {
            return Mirror(Quaternion.Inverse(transform.rotation) * world);
        }

        /// <summary>Rotation in the world for a rotation of the stream.</summary>
        public Quaternion FromStream(Quaternion rotation)
        {
            return transform.rotation * Mirror(rotation);
        }

        static Vector3 Mirror(Vector3 point)
        {
            return new Vector3(point.x, point.y, -point.z);
        }

        // The axis is mirrored, and the sense of rotation changes with the handedness.
        static Quaternion Mirror(Quaternion rotation)
        {
            return new Quaternion(-rotation.x, -rotation.y, rotation.z, rotation.w);
        }

        void OnEnable()
        {
            try
            {
                Client = new Client(new ClientOptions
                {
                    Address = address, Scene = scene, DisplayName = displayName, Role = role, Token = token, PairingCode = pairingCode, Fingerprint = fingerprint,
                    Quality = (uint)quality
                });
                if (playOut) Client.StartPlayOut(delayMs < 0 ? double.NaN : delayMs);
                Client.SetLocalContact(playOut && localContact);
            }
            catch (ArgumentException error)
            {
                Debug.LogError("ClothStream: " + error.Message, this);
                OnDisable();
                enabled = false;
            }
        }

        void Update()
        {
            if (Client == null) return;
            Events news = Client.TakeEvents();
            if ((news & Events.Description) != 0) ++Descriptions;
            Client.Play(Client.NowUs);
            Log();
            if ((news & Events.Token) != 0) Paired?.Invoke(Client.Token);
            if (news != 0) Changed?.Invoke(news);
        }

        // Says each problem once.
        void Log()
        {
            bool hasFailed = Client.State == State.Failed;
            string problem = hasFailed ? Client.ErrorText : Client.Problem;
            if (problem == logged) return;
            logged = problem;
            if (hasFailed) Debug.LogError("ClothStream: " + problem, this);
            else if (problem != "") Debug.LogWarning("ClothStream: " + problem, this);
        }

        void OnDisable()
        {
            Client?.Dispose();
            Client = null;
            logged = "";
        }
    }
}
