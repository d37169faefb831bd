// SPDX-License-Identifier: MIT
// What the export reads from Unity, without types of Unity. All values are as Unity has them: left-handed, metres.
using System.Collections.Generic;

namespace ClothStream.Export
{
    /// <summary>A transform of the figure. Matrices have 16 numbers, row by row, and map to the frame of the figure.</summary>
    public sealed class NodeSource
    {
        public string Name;
        public int Parent = -1; // index of the parent among the nodes; -1: the frame of the figure
        public float[] Matrix;  // at present
    }

    /// <summary>Matrices of all nodes at one time of the animation.</summary>
    public sealed class FrameSource
    {
        public float Time; // seconds
        public float[][] Matrices;
    }

    /// <summary>Mesh of a SkinnedMeshRenderer with its bones.</summary>
    public sealed class SkinnedMeshSource
    {
        public string Name;
        public float[] Positions; // three for each vertex, in the frame of the mesh
        public int[] Triangles;   // three indices each, of all submeshes
        public float[] Uvs;       // two for each vertex; empty or null: none
        public int[] Bones;       // node of each bone
        public float[][] BindPoses;
        public int[] VertexBones; // four indices into Bones for each vertex
        public float[] VertexWeights;

        public int VertexCount { get { return Positions.Length / 3; } }
    }

    /// <summary>Properties of Unity's Cloth, by their names there.</summary>
    public sealed class ClothSource
    {
        public float[] MaxDistances = new float[0]; // of the coefficients, which the cloth has for each place with vertices
        public float[] CollisionSphereDistances = new float[0];
        public float[] Vertices = new float[0]; // Cloth.vertices, three numbers each; empty: unknown
        public float StretchingStiffness = 1, BendingStiffness, StiffnessFrequency = 10, Damping, Friction = 0.5f;
        public float SelfCollisionDistance;
        public bool UseTethers;
        public float[] Gravity = { 0, 0, 0 }; // of the physics, 0 without useGravity; m/s^2 in the frame of the figure
        public float[] ExternalAcceleration = { 0, 0, 0 }, RandomAcceleration = { 0, 0, 0 };
        public float WorldVelocityScale = 1, WorldAccelerationScale = 1;
    }

    /// <summary>CapsuleCollider, in the frame of its node.</summary>
    public sealed class CapsuleSource
    {
        public string Name;
        public int Node;
        public float[] Center = { 0, 0, 0 };
        public float Radius, Height;
        public int Direction; // 0 x, 1 y, 2 z
    }

    /// <summary>SphereCollider, in the frame of its node.</summary>
    public sealed class SphereSource
    {
        public string Name;
        public int Node;
        public float[] Center = { 0, 0, 0 };
        public float Radius;
    }

    /// <summary>ClothSphereColliderPair. Either may be null.</summary>
    public sealed class SpherePairSource
    {
        public SphereSource First, Second;
    }

    public sealed class FigureSource
    {
        public string Name;
        public List<NodeSource> Nodes = new List<NodeSource>();
        public SkinnedMeshSource ClothMesh;
        public ClothSource Cloth;
        public SkinnedMeshSource Body; // null: none
        public List<CapsuleSource> Capsules = new List<CapsuleSource>();
        public List<SpherePairSource> SpherePairs = new List<SpherePairSource>();
        public List<FrameSource> Frames = new List<FrameSource>(); // empty: no animation
    }

    /// <summary>What Unity's Cloth does not say.</summary>
    public sealed class ExportOptions
    {
        public string Material = "";      // of ClothStream, instead of the stiffness, damping and friction of Unity; empty: none
        public double ArealMass = 0.2;    // kg/m^2, without a material
        public double BackstopRadius = 0; // metres; 0: ten mean edges of the cloth
    }

    public sealed class ExportedScene
    {
        public string Json;
        public List<string> Notes = new List<string>(); // what the scene does otherwise than Unity, one sentence each
    }
}
