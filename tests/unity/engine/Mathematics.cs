// SPDX-License-Identifier: MIT
// Stub of Unity's vectors, rotations and transforms. Unity is left-handed; none of these formulas depends on it.
using System;

namespace UnityEngine
{
    public struct Vector2
    {
        public float x, y;
    }

    public struct Vector3
    {
        public float x, y, z;

        public Vector3(float x, float y, float z)
        {
            this.x = x;
            this.y = y;
            this.z = z;
        }

        public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z); }
        public static Vector3 operator *(Vector3 a, float b) { return new Vector3(a.x * b, a.y * b, a.z * b); }
        public static float Dot(Vector3 a, Vector3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
        public static Vector3 Cross(Vector3 a, Vector3 b) { return new Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }
        public static float Distance(Vector3 a, Vector3 b) { return (float)Math.Sqrt(Dot(a - b, a - b)); }
    }

    public struct Quaternion
    {
        public float x, y, z, w;

        public Quaternion(float x, float y, float z, float w)
        {
            this.x = x;
            this.y = y;
            this.z = z;
            this.w = w;
        }

        public static Quaternion identity { get { return new Quaternion(0, 0, 0, 1); } }
        public static Quaternion Inverse(Quaternion a) { return new Quaternion(-a.x, -a.y, -a.z, a.w); }

        public static Quaternion operator *(Quaternion a, Quaternion b)
        {
            return new Quaternion(a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
                                  a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }

        public static Vector3 operator *(Quaternion a, Vector3 point)
        {
            var axis = new Vector3(a.x, a.y, a.z);
            Vector3 twice = Vector3.Cross(axis, point) * 2;
            return point + twice * a.w + Vector3.Cross(axis, twice);
        }
    }

    public struct Pose
    {
        public Vector3 position;
        public Quaternion rotation;
    }

    public struct Bounds
    {
        public Vector3 min, max;
    }

    public static class Mathf
    {
        public static int Min(int a, int b) { return Math.Min(a, b); }
        public static float InverseLerp(float a, float b, float value) { return Math.Max(0, Math.Min(1, (value - a) / (b - a))); }
    }

    public sealed class Transform : Component
    {
        public Transform parent { get; private set; }
        public Vector3 localPosition;
        public Quaternion localRotation = Quaternion.identity;
        public Vector3 localScale = new Vector3(1, 1, 1);

        public Vector3 position
        {
            get { return parent == null ? localPosition : parent.TransformPoint(localPosition); }
            set { localPosition = parent == null ? value : parent.InverseTransformPoint(value); }
        }

        public Quaternion rotation { get { return parent == null ? localRotation : parent.rotation * localRotation; } }

        // Only with worldPositionStays == false.
        public void SetParent(Transform parent, bool worldPositionStays)
        {
            if (worldPositionStays) throw new NotSupportedException();
            this.parent = parent;
        }

        public Vector3 TransformPoint(Vector3 point)
        {
            Vector3 scaled = new Vector3(point.x * localScale.x, point.y * localScale.y, point.z * localScale.z);
            Vector3 local = localPosition + localRotation * scaled;
            return parent == null ? local : parent.TransformPoint(local);
        }

        public Vector3 InverseTransformPoint(Vector3 world)
        {
            Vector3 local = parent == null ? world : parent.InverseTransformPoint(world);
            Vector3 turned = Quaternion.Inverse(localRotation) * (local - localPosition);
            return new Vector3(turned.x / localScale.x, turned.y / localScale.y, turned.z / localScale.z);
        }
    }
}
