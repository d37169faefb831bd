// SPDX-License-Identifier: MIT
// Hands of com.unity.xr.hands, if the project has that package (version 1.1 or later).
#if CLOTHSTREAM_XR_HANDS
using System.Collections.Generic;
using ClothStream.Core;
using UnityEngine;
using UnityEngine.XR.Hands;

namespace ClothStream
{
    static class TrackedHands
    {
        const int Joints = (int)Native.CS_HAND_JOINTS;
        // Radius (m) of a joint whose radius the device does not know.
        const float DefaultRadius = 0.01f;
        // Distances (m) between the tips of thumb and index finger at which a pinch is closed and open.
        const float ClosedAt = 0.015f, OpenAt = 0.05f;

        static readonly List<XRHandSubsystem> systems = new List<XRHandSubsystem>();

        /// <param name="origin">Space of the tracking; null means that of the world.</param>
        /// <param name="sample">Its arrays are filled in.</param>
        public static bool TryGet(HandSide side, Transform origin, ref HandSample sample)
        {
            SubsystemManager.GetSubsystems(systems);
            if (systems.Count == 0 || !systems[0].running) return false;
            XRHand hand = side == HandSide.Left ? systems[0].leftHand : systems[0].rightHand;
            if (!hand.isTracked) return false;
            for (int i = 0; i < Joints; ++i)
            {
                XRHandJoint joint = hand.GetJoint(IdOf(i));
                Pose pose;
                if (!joint.TryGetPose(out pose)) return false;
                float radius;
                sample.joints[i] = origin == null ? pose.position : origin.TransformPoint(pose.position);
                sample.radii[i] = joint.TryGetRadius(out radius) ? radius : DefaultRadius;
                if (i == 0) sample.rotation = origin == null ? pose.rotation : origin.rotation * pose.rotation;
            }
            Vector3 thumb = sample.joints[IndexOf(XRHandJointID.ThumbTip)], finger = sample.joints[IndexOf(XRHandJointID.IndexTip)];
            sample.position = (thumb + finger) * 0.5f;
            sample.strength = Mathf.InverseLerp(OpenAt, ClosedAt, Vector3.Distance(thumb, finger));
            return true;
        }

        // OpenXR begins with the palm, Unity with the wrist.
        static XRHandJointID IdOf(int index)
        {
            return index == 0 ? XRHandJointID.Palm : index == 1 ? XRHandJointID.Wrist : (XRHandJointID)(index + 1);
        }

        // Only for joints of fingers.
        static int IndexOf(XRHandJointID id)
        {
            return (int)id - 1;
        }
    }
}
#endif
