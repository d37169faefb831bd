// SPDX-License-Identifier: MIT
// What a hand or controller does in one frame.
using UnityEngine;

namespace ClothStream
{
    /// <summary>One hand or controller, in world coordinates.</summary>
    public struct HandSample
    {
        /// <summary>26 joints in the order of OpenXR, palm first; null for a controller.</summary>
        public Vector3[] joints;
        /// <summary>Radius of each joint, m.</summary>
        public float[] radii;
        /// <summary>Where cloth is grabbed.</summary>
        public Vector3 position;
        public Quaternion rotation;
        /// <summary>Pinch or trigger, 0 to 1.</summary>
        public float strength;
    }
}
