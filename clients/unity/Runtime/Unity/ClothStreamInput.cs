// SPDX-License-Identifier: MIT
// Sends head, hands and controllers, and grabs cloth.
using ClothStream.Core;
using UnityEngine;
using UnityEngine.XR;

namespace ClothStream
{
    /// <summary>
    /// Sends the tracked hands of this person, or else the controllers, and the head. A pinch or the trigger grabs cloth. Hands
    /// need the package com.unity.xr.hands. A body of the scene follows head and hands if `body` names it.
    /// </summary>
    [AddComponentMenu("ClothStream/ClothStream Input")]
    public sealed class ClothStreamInput : MonoBehaviour
    {
        const int Joints = (int)Native.CS_HAND_JOINTS, Wrist = 1;
        static readonly HandSide[] Sides = { HandSide.Left, HandSide.Right };

        [Tooltip("Connection to which the poses are sent. Empty: the one on this object or its parents.")]
        public ClothStreamConnection connection;
        [Tooltip("Space of the tracking: the camera offset of the XR Origin. Empty: the world.")]
        public Transform trackingOrigin;
        [Tooltip("Head, usually the camera. Empty: no head is sent.")]
        public Transform head;
        [Tooltip("Radius of the head in metres.")]
        [Range(0.05f, 0.3f)]
        public float headRadius = 0.1f;
        [Tooltip("Radius in metres of the sphere that stands for a controller.")]
        [Range(0.01f, 0.2f)]
        public float controllerRadius = 0.04f;
        [Tooltip("Distance in metres within which a pinch or trigger grabs cloth.")]
        [Range(0.01f, 0.3f)]
        public float grabReach = 0.05f;
        [Tooltip("Name of the collider of the scene that this person wears as the own body. Empty: none. Needs a head.")]
        public string body = "";
        [Tooltip("Object at the height of the floor, usually the XR Origin. Empty: the tracking origin, or else the connection.")]
        public Transform floor;

        readonly PinchGrab[] grabs = { new PinchGrab(0), new PinchGrab(1) };
        readonly Grab[] held = new Grab[2];
        readonly ClothPoint[] heldPlaces = new ClothPoint[2];
        readonly float[] joints = new float[4 * Joints];
        readonly StreamPose pose = new StreamPose();
        readonly OwnCollider[] spheres = new OwnCollider[2];
        readonly Vector3[] places = new Vector3[Joints];
        readonly float[] radii = new float[Joints];
        static readonly float[] NoJoints = new float[0];
        Client wearing; // that was asked for `worn`
        string worn = "";

        /// <summary>Whether a body of the scene follows this person.</summary>
        public bool IsWearing { get; private set; }

        void OnEnable()
        {
            if (connection == null) connection = GetComponentInParent<ClothStreamConnection>();
            if (connection != null) return;
            Debug.LogError("ClothStream: ClothStream Input has no connection. Set it in the inspector.", this);
            enabled = false;
        }

        void Update()
        {
            if (!connection.IsJoined) return;
            Client client = connection.Client;
            ulong nowUs = Client.NowUs;
            int count = 0, sphereCount = 0;
            var person = new PersonSample();
            for (int i = 0; i < Sides.Length; ++i)
            {
                var sample = new HandSample { joints = places, radii = radii };
                bool isTracked = TryGetHand(Sides[i], ref sample);
                client.SetHand(Sides[i], isTracked ? StreamJoints(sample) : NoJoints, nowUs);
                if (isTracked) person.SetHand(Sides[i], connection.ToStream(sample.joints[Wrist]), connection.ToStream(sample.rotation));
                if (!isTracked && TryGetController(Sides[i], ref sample))
                {
                    isTracked = true;
                    spheres[sphereCount++] = Sphere(sample.position);
                    person.SetGrip(Sides[i], connection.ToStream(sample.position), connection.ToStream(sample.rotation));
                }
                if (isTracked) UpdateGrab(client, grabs[i], sample);
                else grabs[i].Release();
                if (!grabs[i].IsHolding) continue;
                held[count] = grabs[i].Grab;
                heldPlaces[count++] = grabs[i].Place;
            }
            client.SetShapes(spheres, sphereCount, nowUs);
            client.SetGrabs(held, heldPlaces, count, nowUs);
            if (head == null) return;
            pose.Set(connection.ToStream(head.position), connection.ToStream(head.rotation));
            client.SetHead(pose.Position, pose.Orientation, headRadius, nowUs);
            MoveBody(client, person, nowUs);
        }

        void MoveBody(Client client, PersonSample person, ulong nowUs)
        {
            if (wearing != client || worn != body)
            {
                wearing = client;
                worn = body;
                if (!client.Wear(body)) Debug.LogWarning("ClothStream: The scene has no body \"" + body + "\". " + BodiesOf(client), this);
            }
            Transform ground = floor != null ? floor : trackingOrigin != null ? trackingOrigin : connection.transform;
            person.SetFloor(connection.ToStream(ground.position).y);
            person.SetHead(connection.ToStream(head.position), connection.ToStream(head.rotation));
            IsWearing = client.SetBody(person.Tracked, nowUs);
        }

        static string BodiesOf(Client client)
        {
            string[] names = System.Array.ConvertAll(client.Bodies, one => one.Value);
            return names.Length == 0 ? "It has none." : "Use " + string.Join(", ", names) + ".";
        }

        void OnDisable()
        {
            foreach (PinchGrab grab in grabs) grab.Release();
            Client client = connection != null ? connection.Client : null;
            if (client == null) return;
            ulong nowUs = Client.NowUs;
            foreach (HandSide side in Sides) client.SetHand(side, NoJoints, nowUs);
            client.SetShapes(spheres, 0, nowUs);
            client.SetGrabs(held, null, 0, nowUs);
            client.SetHead(null, null, headRadius, nowUs);
            if (worn != "") client.Wear("");
            worn = "";
            IsWearing = false;
        }

        bool TryGetHand(HandSide side, ref HandSample sample)
        {
#if CLOTHSTREAM_XR_HANDS
            return TrackedHands.TryGet(side, trackingOrigin, ref sample);
#else
            return false;
#endif
        }

        bool TryGetController(HandSide side, ref HandSample sample)
        {
            InputDevice device = InputDevices.GetDeviceAtXRNode(side == HandSide.Left ? XRNode.LeftHand : XRNode.RightHand);
            Vector3 at;
            Quaternion turned;
            if (!device.isValid || !device.TryGetFeatureValue(CommonUsages.devicePosition, out at) ||
                !device.TryGetFeatureValue(CommonUsages.deviceRotation, out turned)) return false;
            sample.position = trackingOrigin == null ? at : trackingOrigin.TransformPoint(at);
            sample.rotation = trackingOrigin == null ? turned : trackingOrigin.rotation * turned;
            device.TryGetFeatureValue(CommonUsages.trigger, out sample.strength);
            return true;
        }

        void UpdateGrab(Client client, PinchGrab grab, HandSample sample)
        {
            pose.Set(connection.ToStream(sample.position), connection.ToStream(sample.rotation));
            grab.Reach = grabReach;
            grab.Update(client, sample.strength, pose.Position, pose.Orientation);
        }

        float[] StreamJoints(HandSample sample)
        {
            for (int i = 0; i < Joints; ++i)
            {
                Vector3 point = connection.ToStream(sample.joints[i]);
                joints[4 * i] = point.x;
                joints[4 * i + 1] = point.y;
                joints[4 * i + 2] = point.z;
                joints[4 * i + 3] = sample.radii[i];
            }
            return joints;
        }

        unsafe OwnCollider Sphere(Vector3 world)
        {
            Vector3 point = connection.ToStream(world);
            var sphere = new OwnCollider { shape = (uint)Shape.Sphere, radius = controllerRadius };
            sphere.position[0] = point.x;
            sphere.position[1] = point.y;
            sphere.position[2] = point.z;
            return sphere;
        }
    }
}
