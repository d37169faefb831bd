// SPDX-License-Identifier: MIT
// Draws the cloths of a connection as one mesh.
using ClothStream.Core;
using Unity.Collections;
using Unity.Collections.LowLevel.Unsafe;
using UnityEngine;
using UnityEngine.Rendering;

namespace ClothStream
{
    /// <summary>
    /// Draws all cloths of a scene: one mesh with a submesh for each cloth, under the connection. Its vertices keep the
    /// right-handed coordinates of the stream, and Unity takes them from the memory of the client core, without a copy in C#.
    /// The object of the mesh has the scale (1, 1, -1). Unity shows the other side of triangles under such a scale, which are
    /// the fronts: those that are counter-clockwise in a right-handed system.
    /// </summary>
    [AddComponentMenu("ClothStream/Streamed Cloth")]
    public sealed unsafe class StreamedCloth : MonoBehaviour
    {
        internal const MeshUpdateFlags Unchecked = MeshUpdateFlags.DontValidateIndices | MeshUpdateFlags.DontNotifyMeshUsers |
                                                   MeshUpdateFlags.DontRecalculateBounds | MeshUpdateFlags.DontResetBoneBounds;

        [Tooltip("Connection whose cloths are drawn. Empty: the one on this object or its parents.")]
        public ClothStreamConnection connection;
        [Tooltip("Material of each cloth; further cloths use the last one. Cloth has two sides: choose a material that renders both faces.")]
        public Material[] materials = new Material[0];

        static readonly VertexAttributeDescriptor[] Layout =
        {
            new VertexAttributeDescriptor(VertexAttribute.Position, VertexAttributeFormat.Float32, 3, 0),
            new VertexAttributeDescriptor(VertexAttribute.Normal, VertexAttributeFormat.Float32, 3, 1),
            new VertexAttributeDescriptor(VertexAttribute.TexCoord0, VertexAttributeFormat.Float32, 2, 2)
        };

        GameObject drawn;
        MeshRenderer meshRenderer;
        int descriptions;

        /// <summary>Mesh of all cloths; null while this component is disabled. Its bounds follow the vertices.</summary>
        public Mesh Mesh { get; private set; }

        void OnEnable()
        {
            if (connection == null) connection = GetComponentInParent<ClothStreamConnection>();
            if (connection == null)
            {
                Debug.LogError("ClothStream: Streamed Cloth has no connection. Set it in the inspector.", this);
                enabled = false;
                return;
            }
            Mesh = new Mesh { name = "Streamed Cloth" };
            Mesh.MarkDynamic();
            drawn = new GameObject("Streamed Cloth", typeof(MeshFilter), typeof(MeshRenderer));
            drawn.transform.SetParent(connection.transform, false);
            drawn.transform.localScale = new Vector3(1, 1, -1);
            drawn.GetComponent<MeshFilter>().sharedMesh = Mesh;
            meshRenderer = drawn.GetComponent<MeshRenderer>();
            descriptions = -1;
        }

        void LateUpdate()
        {
            Client client = connection.Client;
            if (client == null || connection.Descriptions == 0) return;
            lock (client.Gate)
            {
                if (client.VertexCount == 0) return;
                if (descriptions != connection.Descriptions) Describe(client);
                // A new description has arrived after the Update of the connection.
                if (client.VertexCount != Mesh.vertexCount) return;
                Write(client.ShownPositions, 0);
                Write(client.ShownNormals, 1);
            }
            Mesh.RecalculateBounds();
        }

        void OnDisable()
        {
            if (drawn != null) Destroy(drawn);
            if (Mesh != null) Destroy(Mesh);
            drawn = null;
            Mesh = null;
        }

        void Describe(Client client)
        {
            descriptions = connection.Descriptions;
            ClothRange[] cloths = client.Cloths;
            Mesh.Clear();
            Mesh.SetVertexBufferParams(client.VertexCount, Layout);
            int indexCount;
            uint* triangles = client.Triangles(out indexCount);
            Mesh.SetIndexBufferParams(indexCount, IndexFormat.UInt32);
            Mesh.SetIndexBufferData(View<uint>(triangles, indexCount), 0, 0, indexCount, Unchecked);
            Write(client.ShownPositions, 0);
            var uvs = new Vector2[client.VertexCount];
            fixed (Vector2* first = uvs)
                for (int i = 0; i < cloths.Length; ++i) client.TextureCoordinates(i, (float*)(first + cloths[i].FirstVertex));
            Mesh.SetVertexBufferData(uvs, 0, 0, uvs.Length, 2, Unchecked);
            Mesh.subMeshCount = cloths.Length;
            for (int i = 0; i < cloths.Length; ++i) Mesh.SetSubMesh(i, new SubMeshDescriptor(cloths[i].FirstIndex, cloths[i].IndexCount));
            SetMaterials(cloths.Length);
        }

        void SetMaterials(int cloths)
        {
            if (materials.Length == 0) return;
            var used = new Material[cloths];
            for (int i = 0; i < cloths; ++i) used[i] = materials[Mathf.Min(i, materials.Length - 1)];
            meshRenderer.sharedMaterials = used;
        }

        void Write(float* vectors, int stream)
        {
            Mesh.SetVertexBufferData(View<Vector3>(vectors, Mesh.vertexCount), 0, 0, Mesh.vertexCount, stream, Unchecked);
        }

        // Memory of the client core as an array, without a copy.
        internal static NativeArray<T> View<T>(void* first, int count) where T : struct
        {
            NativeArray<T> view = NativeArrayUnsafeUtility.ConvertExistingDataToNativeArray<T>(first, count, Allocator.None);
#if ENABLE_UNITY_COLLECTIONS_CHECKS
            NativeArrayUnsafeUtility.SetAtomicSafetyHandle(ref view, AtomicSafetyHandle.GetTempUnsafePtrSliceHandle());
#endif
            return view;
        }
    }
}
