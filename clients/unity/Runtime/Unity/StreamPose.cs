// SPDX-License-Identifier: MIT
// A pose as the client core takes it.
using UnityEngine;

namespace ClothStream
{
    // Position in metres and orientation as a quaternion (x, y, z, w), in the coordinates of the stream. At first neither is a
    // pose: the orientation is zero.
    sealed class StreamPose
    {
        public readonly float[] Position = new float[3], Orientation = new float[4];

        public void Set(Vector3 position, Quaternion rotation)
        {
            Position[0] = position.x;
            Position[1] = position.y;
            Position[2] = position.z;
            Orientation[0] = rotation.x;
            Orientation[1] = rotation.y;
            Orientation[2] = rotation.z;
            Orientation[3] = rotation.w;
        }
    }
}
