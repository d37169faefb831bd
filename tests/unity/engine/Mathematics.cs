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

    // Column vectors: m03, m13 and m23 are the translation.
    public struct Matrix4x4
    {
        public float m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23, m30, m31, m32, m33;

        public static Matrix4x4 identity { get { return TRS(new Vector3(), Quaternion.identity, new Vector3(1, 1, 1)); } }

        public static Matrix4x4 TRS(Vector3 pos, Quaternion q, Vector3 s)
        {
            return Columns(q * new Vector3(s.x, 0, 0), q * new Vector3(0, s.y, 0), q * new Vector3(0, 0, s.z), pos);
        }

        // Of an affine matrix.
        public Matrix4x4 inverse
        {
            get
            {
                Vector3 a = new Vector3(m00, m10, m20), b = new Vector3(m01, m11, m21), c = new Vector3(m02, m12, m22);
                float factor = 1 / Vector3.Dot(Vector3.Cross(a, b), c);
                Vector3 x = Vector3.Cross(b, c) * factor, y = Vector3.Cross(c, a) * factor, z = Vector3.Cross(a, b) * factor;
                var moved = new Vector3(-m03, -m13, -m23);
                return Columns(new Vector3(x.x, y.x, z.x), new Vector3(x.y, y.y, z.y), new Vector3(x.z, y.z, z.z),
                               new Vector3(Vector3.Dot(x, moved), Vector3.Dot(y, moved), Vector3.Dot(z, moved)));
            }
        }

        public Vector3 MultiplyVector(Vector3 v)
        {
            return new Vector3(m00 * v.x + m01 * v.y + m02 * v.z, m10 * v.x + m11 * v.y + m12 * v.z, m20 * v.x + m21 * v.y + m22 * v.z);
        }

        public Vector3 MultiplyPoint3x4(Vector3 v) { return MultiplyVector(v) + new Vector3(m03, m13, m23); }

        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b)
        {
            return Columns(a.MultiplyVector(new Vector3(b.m00, b.m10, b.m20)), a.MultiplyVector(new Vector3(b.m01, b.m11, b.m21)),
                           a.MultiplyVector(new Vector3(b.m02, b.m12, b.m22)), a.MultiplyPoint3x4(new Vector3(b.m03, b.m13, b.m23)));
        }

        static Matrix4x4 Columns(Vector3 a, Vector3 b, Vector3 c, Vector3 d)
        {
            return new Matrix4x4 { m00 = a.x, m10 = a.y, m20 = a.z, m01 = b.x, m11 = b.y, m21 = b.z, m02 = c.x, m12 = c.y, m22 = c.z, m03 = d.x, m13 = d.y, m23 = d.z, m33 = 1 };
        }
    }

    public struct Bounds
    {
        public Vector3 min, max;
    }

    public static class Mathf
    {
        public static int Min(int a, int b) { return Math.Min(a, b); }
        public static float Max(float a, float b) { return Math.Max(a, b); }
        public static float Abs(float value) { return Math.Abs(value); }
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

        public Vector3 lossyScale
        {
            get
            {
                Vector3 of = parent == null ? new Vector3(1, 1, 1) : parent.lossyScale;
                return new Vector3(of.x * localScale.x, of.y * localScale.y, of.z * localScale.z);
            }
        }

        public Matrix4x4 localToWorldMatrix
        {
            get
            {
                Matrix4x4 local = Matrix4x4.TRS(localPosition, localRotation, localScale);
                return parent == null ? local : parent.localToWorldMatrix * local;
            }
        }

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
