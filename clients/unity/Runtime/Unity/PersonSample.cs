// SPDX-License-Identifier: MIT
// What is known of a person in one frame, for the body that the person wears.
using ClothStream.Core;
using UnityEngine;

namespace ClothStream
{
    /// <summary>Head, wrists and floor of a person, in the coordinates of the stream.</summary>
    public unsafe struct PersonSample
    {
        // Way (m) from the palm that holds a controller back to the wrist.
        const float PalmToWrist = 0.08f;
        // From the grip of OpenXR to the hand. The grip's -Z leads to the thumb, and its +X leaves the back of the left hand, or
        // the palm of the right one. The hand's fingers are at -Z and its back is at +Y.
        static readonly Quaternion LeftHand = new Quaternion(0.5f, 0.5f, -0.5f, 0.5f), RightHand = new Quaternion(0.5f, -0.5f, 0.5f, 0.5f);

        TrackedBody tracked;

        /// <summary>What Client.SetBody takes.</summary>
        public TrackedBody Tracked { get { return tracked; } }

        /// <summary>Height of the floor, m.</summary>
        public void SetFloor(float height)
        {
            tracked.floor = height;
        }

        /// <summary>Between the eyes; looks along -Z.</summary>
        public void SetHead(Vector3 position, Quaternion rotation)
        {
            tracked.parts |= (uint)BodyPart.Head;
            fixed (float* to = tracked.head) Store(to, position, rotation);
        }

        /// <summary>Wrist; the fingers are at -Z, and the back of the hand is at +Y.</summary>
        public void SetHand(HandSide side, Vector3 wrist, Quaternion rotation)
        {
            tracked.parts |= (uint)(side == HandSide.Left ? BodyPart.LeftHand : BodyPart.RightHand);
            fixed (float* left = tracked.leftHand, right = tracked.rightHand) Store(side == HandSide.Left ? left : right, wrist, rotation);
        }

        /// <summary>Hand that holds a controller with this grip.</summary>
        public void SetGrip(HandSide side, Vector3 position, Quaternion rotation)
        {
            SetHand(side, position + rotation * new Vector3(0, -PalmToWrist, 0), rotation * (side == HandSide.Left ? LeftHand : RightHand));
        }

        static void Store(float* to, Vector3 position, Quaternion rotation)
        {
            to[0] = position.x;
            to[1] = position.y;
            to[2] = position.z;
            to[3] = rotation.x;
            to[4] = rotation.y;
            to[5] = rotation.z;
            to[6] = rotation.w;
        }
    }
}
