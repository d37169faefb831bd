// SPDX-License-Identifier: MIT
// Stub of Unity's meshes and native arrays. A mesh keeps what it is given, and refuses what Unity refuses.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Runtime.InteropServices;
using Unity.Collections;
using UnityEngine.Rendering;

namespace UnityEngine
{
    public sealed class Material : Object { }

    public sealed class MeshFilter : Component
    {
        public Mesh sharedMesh { get; set; }
    }

    public sealed class MeshRenderer : Component
    {
        public Material[] sharedMaterials { get; set; }
    }

    public sealed unsafe class Mesh : Object
    {
        readonly Dictionary<int, byte[]> streams = new Dictionary<int, byte[]>();
        readonly Dictionary<int, int> strides = new Dictionary<int, int>();
        byte[] indices = new byte[0];
        SubMeshDescriptor[] subMeshes = new SubMeshDescriptor[0];

        // Arrays of a mesh with bones, which a test sets. Unity derives them from the same buffers as those below.
        public Vector3[] vertices { get; set; } = new Vector3[0];
        public Vector2[] uv { get; set; } = new Vector2[0];
        public int[] triangles { get; set; } = new int[0];
        public BoneWeight[] boneWeights { get; set; } = new BoneWeight[0];
        public Matrix4x4[] bindposes { get; set; } = new Matrix4x4[0];
        public bool isReadable { get; set; } = true;

        public void GetVertices(List<Vector3> vertices)
        {
            vertices.Clear();
            vertices.AddRange(this.vertices);
        }

        // All triangles are in the first submesh.
        public void GetTriangles(List<int> triangles, int submesh)
        {
            triangles.Clear();
            if (submesh == 0) triangles.AddRange(this.triangles);
        }

        public int vertexCount { get; private set; }
        public Bounds bounds { get; private set; }
        public bool IsDynamic { get; private set; }
        public byte[] Stream(int stream) { return streams[stream]; }
        public byte[] Indices { get { return indices; } }
        public SubMeshDescriptor SubMesh(int index) { return subMeshes[index]; }

        public int subMeshCount
        {
            get { return subMeshes.Length; }
            set { Array.Resize(ref subMeshes, value); }
        }

        public void MarkDynamic() { IsDynamic = true; }

        public void Clear()
        {
            streams.Clear();
            strides.Clear();
            indices = new byte[0];
            subMeshes = new SubMeshDescriptor[0];
            vertexCount = 0;
        }

        public void SetVertexBufferParams(int vertexCount, params VertexAttributeDescriptor[] attributes)
        {
            this.vertexCount = vertexCount;
            foreach (IGrouping<int, VertexAttributeDescriptor> stream in attributes.GroupBy(attribute => attribute.stream))
            {
                strides[stream.Key] = stream.Sum(attribute => attribute.dimension * sizeof(float));
                streams[stream.Key] = new byte[strides[stream.Key] * vertexCount];
            }
        }

        public void SetVertexBufferData<T>(NativeArray<T> data, int dataStart, int meshBufferStart, int count, int stream, MeshUpdateFlags flags) where T : struct
        {
            Copy(data, dataStart, streams[stream], meshBufferStart, count);
        }

        public void SetVertexBufferData<T>(T[] data, int dataStart, int meshBufferStart, int count, int stream, MeshUpdateFlags flags) where T : struct
        {
            GCHandle pinned = GCHandle.Alloc(data, GCHandleType.Pinned);
            try { Copy(new NativeArray<T>((void*)pinned.AddrOfPinnedObject(), data.Length), dataStart, streams[stream], meshBufferStart, count); }
            finally { pinned.Free(); }
        }

        public void SetIndexBufferParams(int indexCount, IndexFormat format)
        {
            if (format != IndexFormat.UInt32) throw new NotSupportedException();
            indices = new byte[4 * indexCount];
        }

        public void SetIndexBufferData<T>(NativeArray<T> data, int dataStart, int meshBufferStart, int count, MeshUpdateFlags flags) where T : struct
        {
            Copy(data, dataStart, indices, meshBufferStart, count);
        }

        public void SetSubMesh(int index, SubMeshDescriptor desc, MeshUpdateFlags flags = MeshUpdateFlags.Default)
        {
            if (desc.indexStart < 0 || desc.indexStart + desc.indexCount > indices.Length / 4) throw new ArgumentException("the submesh is outside the index buffer");
            subMeshes[index] = desc;
        }

        public void RecalculateBounds()
        {
            if (vertexCount == 0) return;
            var found = new Bounds { min = VertexAt(0), max = VertexAt(0) };
            for (int i = 0; i < vertexCount; ++i)
            {
                Vector3 vertex = VertexAt(i);
                found.min = new Vector3(Math.Min(found.min.x, vertex.x), Math.Min(found.min.y, vertex.y), Math.Min(found.min.z, vertex.z));
                found.max = new Vector3(Math.Max(found.max.x, vertex.x), Math.Max(found.max.y, vertex.y), Math.Max(found.max.z, vertex.z));
            }
            bounds = found;
        }

        // Fills the second stream, with the mean of the triangles by their areas.
        public void RecalculateNormals()
        {
            var sums = new Vector3[vertexCount];
            for (int i = 0; i < indices.Length; i += 12)
            {
                int a = BitConverter.ToInt32(indices, i), b = BitConverter.ToInt32(indices, i + 4), c = BitConverter.ToInt32(indices, i + 8);
                Vector3 normal = Vector3.Cross(VertexAt(b) - VertexAt(a), VertexAt(c) - VertexAt(a));
                foreach (int corner in new[] { a, b, c }) sums[corner] = sums[corner] + normal;
            }
            for (int i = 0; i < vertexCount; ++i)
            {
                float length = Vector3.Distance(sums[i], new Vector3());
                if (length > 0) sums[i] = sums[i] * (1 / length);
            }
            SetVertexBufferData(sums, 0, 0, vertexCount, 1, MeshUpdateFlags.Default);
        }

        public Vector3 VertexAt(int index) { return VectorAt(0, index); }
        public Vector3 NormalAt(int index) { return VectorAt(1, index); }

        Vector3 VectorAt(int stream, int index)
        {
            byte[] bytes = streams[stream];
            return new Vector3(BitConverter.ToSingle(bytes, 12 * index), BitConverter.ToSingle(bytes, 12 * index + 4), BitConverter.ToSingle(bytes, 12 * index + 8));
        }

        static void Copy<T>(NativeArray<T> from, int dataStart, byte[] to, int start, int count) where T : struct
        {
            int size = Marshal.SizeOf(typeof(T));
            if (dataStart < 0 || dataStart + count > from.Length) throw new IndexOutOfRangeException("the source array is too short");
            if (start < 0 || size * (start + count) > to.Length) throw new ArgumentException("the data does not fit into the buffer");
            Marshal.Copy((IntPtr)((byte*)from.First + size * dataStart), to, size * start, size * count);
        }
    }
}

namespace UnityEngine.Rendering
{
    public enum VertexAttribute { Position, Normal, TexCoord0 = 4 }
    public enum VertexAttributeFormat { Float32 }
    public enum IndexFormat { UInt16, UInt32 }

    [Flags]
    public enum MeshUpdateFlags { Default = 0, DontValidateIndices = 1, DontResetBoneBounds = 2, DontNotifyMeshUsers = 4, DontRecalculateBounds = 8 }

    public struct VertexAttributeDescriptor
    {
        public int dimension, stream;

        public VertexAttributeDescriptor(VertexAttribute attribute, VertexAttributeFormat format, int dimension, int stream)
        {
            this.dimension = dimension;
            this.stream = stream;
        }
    }

    public struct SubMeshDescriptor
    {
        public int indexStart, indexCount;

        public SubMeshDescriptor(int indexStart, int indexCount)
        {
            this.indexStart = indexStart;
            this.indexCount = indexCount;
        }
    }
}

namespace Unity.Collections
{
    public enum Allocator { Invalid, None }

    public unsafe struct NativeArray<T> where T : struct
    {
        internal readonly void* First;
        public readonly int Length;

        internal NativeArray(void* first, int length)
        {
            First = first;
            Length = length;
        }
    }
}

namespace Unity.Collections.LowLevel.Unsafe
{
    public struct AtomicSafetyHandle
    {
        public static AtomicSafetyHandle GetTempUnsafePtrSliceHandle() { return new AtomicSafetyHandle(); }
    }

    public static unsafe class NativeArrayUnsafeUtility
    {
        public static NativeArray<T> ConvertExistingDataToNativeArray<T>(void* dataPointer, int length, Allocator allocator) where T : struct
        {
            return new NativeArray<T>(dataPointer, length);
        }

        public static void SetAtomicSafetyHandle<T>(ref NativeArray<T> array, AtomicSafetyHandle safety) where T : struct { }
    }
}
