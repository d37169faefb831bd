// SPDX-License-Identifier: MIT
// Stub of Unity's XR devices and of the package com.unity.xr.hands. A test sets their poses.
using System.Collections.Generic;
using UnityEngine.XR;
using UnityEngine.XR.Hands;

namespace UnityEngine
{
    public static class SubsystemManager
    {
        public static readonly XRHandSubsystem Hands = new XRHandSubsystem();

        public static void GetSubsystems(List<XRHandSubsystem> subsystems)
        {
            subsystems.Clear();
            subsystems.Add(Hands);
        }
    }
}

namespace UnityEngine.XR
{
    public enum XRNode { LeftHand = 4, RightHand = 5 }

    public struct InputFeatureUsage<T>
    {
        public string name;
    }

    public static class CommonUsages
    {
        public static InputFeatureUsage<Vector3> devicePosition;
        public static InputFeatureUsage<Quaternion> deviceRotation;
        public static InputFeatureUsage<float> trigger;
    }

    public struct InputDevice
    {
        public bool isValid;
        public Vector3 Position;
        public float Trigger;

        public bool TryGetFeatureValue(InputFeatureUsage<Vector3> usage, out Vector3 value)
        {
            value = Position;
            return isValid;
        }

        public bool TryGetFeatureValue(InputFeatureUsage<Quaternion> usage, out Quaternion value)
        {
            value = Quaternion.identity;
            return isValid;
        }

        public bool TryGetFeatureValue(InputFeatureUsage<float> usage, out float value)
        {
            value = Trigger;
            return isValid;
        }
    }

    public static class InputDevices
    {
        public static readonly Dictionary<XRNode, InputDevice> Devices = new Dictionary<XRNode, InputDevice>();

        public static InputDevice GetDeviceAtXRNode(XRNode node)
        {
            InputDevice device;
            Devices.TryGetValue(node, out device);
            return device;
        }
    }
}

namespace UnityEngine.XR.Hands
{
    // The order of the package: wrist, palm, and the joints of each finger from thumb to little finger.
    public enum XRHandJointID { Invalid, Wrist, Palm, ThumbMetacarpal, ThumbProximal, ThumbDistal, ThumbTip, IndexMetacarpal, IndexProximal, IndexIntermediate, IndexDistal, IndexTip }

    public struct XRHandJoint
    {
        public Vector3 Position;
        public float Radius;

        public bool TryGetPose(out Pose pose)
        {
            pose = new Pose { position = Position, rotation = Quaternion.identity };
            return true;
        }

        // 0 stands for an unknown radius.
        public bool TryGetRadius(out float radius)
        {
            radius = Radius;
            return Radius > 0;
        }
    }

    public struct XRHand
    {
        public XRHandJoint[] Joints; // by id
        public bool isTracked { get { return Joints != null; } }
        public XRHandJoint GetJoint(XRHandJointID id) { return Joints[(int)id]; }
    }

    public sealed class XRHandSubsystem
    {
        public bool running = true;
        public XRHand leftHand, rightHand;
    }
}
