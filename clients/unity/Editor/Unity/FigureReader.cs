// SPDX-License-Identifier: MIT
// Reads a SkinnedMeshRenderer with a Cloth, its bones and its colliders from the scene of Unity.
using System;
using System.Collections.Generic;
using System.Linq;
using ClothStream.Export;
using UnityEditor;
using UnityEngine;

namespace ClothStream.Editor
{
    /// <summary>What the user chooses. Only `cloth` is needed.</summary>
    public sealed class FigureChoice
    {
        public SkinnedMeshRenderer cloth;
        public SkinnedMeshRenderer body;  // closed mesh with the same bones
        public AnimationClip clip;        // of the root object of the cloth, or of its Animator
        public float framesPerSecond = 30;
    }

    public sealed class FigureReader
    {
        readonly FigureChoice choice;
        readonly Transform root;
        readonly Matrix4x4 toFigure;
        readonly FigureSource figure = new FigureSource();
        readonly List<Transform> transforms = new List<Transform>(); // of the nodes of the figure

        /// <exception cref="ExportException">The choice cannot become a scene.</exception>
        public static FigureSource Read(FigureChoice choice)
        {
            if (choice.cloth == null) throw new ExportException("No cloth is chosen. Choose an object with a SkinnedMeshRenderer and a Cloth.");
            return new FigureReader(choice).Read();
        }

        FigureReader(FigureChoice choice)
        {
            this.choice = choice;
            root = choice.cloth.transform;
            while (root.parent != null) root = root.parent;
            // The scale of the root stays in the figure, because distances of Unity's Cloth are in its world.
            toFigure = Matrix4x4.TRS(root.position, root.rotation, new Vector3(1, 1, 1)).inverse;
        }

        FigureSource Read()
        {
            var cloth = choice.cloth.GetComponent<Cloth>();
            if (cloth == null) throw new ExportException(choice.cloth.name + " has no Cloth component. Choose an object with a SkinnedMeshRenderer and a Cloth.");
            if (choice.body == choice.cloth) throw new ExportException(choice.body.name + " is chosen as cloth and as body. Choose another body, or none.");
            figure.Name = choice.cloth.name;
            figure.ClothMesh = ReadMesh(choice.cloth);
            figure.Cloth = ReadCloth(cloth);
            if (choice.body != null) figure.Body = ReadMesh(choice.body);
            foreach (CapsuleCollider capsule in cloth.capsuleColliders)
                if (capsule != null) figure.Capsules.Add(new CapsuleSource { Name = capsule.name, Node = NodeOf(capsule.transform), Center = Numbers(capsule.center), Radius = capsule.radius, Height = capsule.height, Direction = capsule.direction });
            foreach (ClothSphereColliderPair pair in cloth.sphereColliders) figure.SpherePairs.Add(new SpherePairSource { First = ReadSphere(pair.first), Second = ReadSphere(pair.second) });
            if (choice.clip != null) ReadFrames();
            return figure;
        }

        SphereSource ReadSphere(SphereCollider sphere)
        {
            return sphere == null ? null : new SphereSource { Name = sphere.name, Node = NodeOf(sphere.transform), Center = Numbers(sphere.center), Radius = sphere.radius };
        }

        ClothSource ReadCloth(Cloth cloth)
        {
            ClothSkinningCoefficient[] coefficients = cloth.coefficients;
            return new ClothSource
            {
                MaxDistances = coefficients.Select(coefficient => coefficient.maxDistance).ToArray(),
                CollisionSphereDistances = coefficients.Select(coefficient => coefficient.collisionSphereDistance).ToArray(),
                Vertices = cloth.vertices.SelectMany(vertex => Numbers(vertex)).ToArray(),
                StretchingStiffness = cloth.stretchingStiffness,
                BendingStiffness = cloth.bendingStiffness,
                StiffnessFrequency = cloth.stiffnessFrequency,
                Damping = cloth.damping,
                Friction = cloth.friction,
                SelfCollisionDistance = cloth.selfCollisionDistance,
                UseTethers = cloth.useTethers,
                Gravity = cloth.useGravity ? Direction(Physics.gravity) : new[] { 0f, 0, 0 },
                ExternalAcceleration = Direction(cloth.externalAcceleration),
                RandomAcceleration = Direction(cloth.randomAcceleration),
                WorldVelocityScale = cloth.worldVelocityScale,
                WorldAccelerationScale = cloth.worldAccelerationScale
            };
        }

        SkinnedMeshSource ReadMesh(SkinnedMeshRenderer renderer)
        {
            Mesh mesh = renderer.sharedMesh;
            if (mesh == null) throw new ExportException(renderer.name + " has no mesh.");
            if (!mesh.isReadable) throw new ExportException(renderer.name + ": the mesh " + mesh.name + " cannot be read. Switch on Read/Write in the import settings of its model.");
            Transform[] bones = renderer.bones;
            for (int i = 0; i < bones.Length; ++i)
                if (bones[i] == null) throw new ExportException(renderer.name + ": bone " + i + " is missing. Restore the skeleton of the renderer.");
            BoneWeight[] weights = mesh.boneWeights;
            if (bones.Length == 0 && weights.Length > 0)
                throw new ExportException(renderer.name + ": the mesh has weights, but the renderer has no bones. Switch off Optimize Game Objects in the import settings of its model.");
            var source = new SkinnedMeshSource
            {
                Name = renderer.name,
                Positions = mesh.vertices.SelectMany(vertex => Numbers(vertex)).ToArray(),
                Triangles = mesh.triangles,
                Uvs = mesh.uv.SelectMany(uv => new[] { uv.x, uv.y }).ToArray(),
                Bones = bones.Select(bone => NodeOf(bone)).ToArray(),
                BindPoses = mesh.bindposes.Select(pose => Numbers(pose)).ToArray()
            };
            source.VertexBones = weights.SelectMany(weight => new[] { weight.boneIndex0, weight.boneIndex1, weight.boneIndex2, weight.boneIndex3 }).ToArray();
            source.VertexWeights = weights.SelectMany(weight => new[] { weight.weight0, weight.weight1, weight.weight2, weight.weight3 }).ToArray();
            if (bones.Length == 0) FollowTransform(renderer, source);
            return source;
        }

        // Unity moves a mesh without bones, such as a flag, with the transform of its renderer.
        void FollowTransform(SkinnedMeshRenderer renderer, SkinnedMeshSource source)
        {
            source.Bones = new[] { NodeOf(renderer.transform) };
            source.BindPoses = new[] { Numbers(Matrix4x4.identity) };
            source.VertexBones = new int[4 * source.VertexCount];
            source.VertexWeights = Enumerable.Range(0, 4 * source.VertexCount).Select(i => i % 4 == 0 ? 1f : 0).ToArray();
        }

        // Samples the clip as the Animation window does, which restores the pose afterwards.
        void ReadFrames()
        {
            float length = choice.clip.length, rate = choice.framesPerSecond;
            if (!(rate > 0 && rate <= 1000)) throw new ExportException("The rate of the animation is " + rate + " frames per second. Choose 1 to 1000.");
            if (!(length > 0)) throw new ExportException("The clip " + choice.clip.name + " has no length. Choose another one, or none.");
            int steps = Math.Max(1, (int)Math.Round(length * rate));
            if (steps >= 100000) throw new ExportException("The clip " + choice.clip.name + " has " + steps + " frames at this rate. Choose a lower rate or a shorter clip.");
            var animator = choice.cloth.GetComponentInParent<Animator>();
            GameObject animated = animator != null ? animator.gameObject : root.gameObject;
            AnimationMode.StartAnimationMode();
            try
            {
                for (int step = 0; step <= steps; ++step)
                {
                    float time = length * step / steps;
                    AnimationMode.BeginSampling();
                    AnimationMode.SampleAnimationClip(animated, choice.clip, time);
                    AnimationMode.EndSampling();
                    figure.Frames.Add(new FrameSource { Time = time, Matrices = transforms.Select(transform => MatrixOf(transform)).ToArray() });
                }
            }
            finally
            {
                AnimationMode.StopAnimationMode();
            }
        }

        // Adds a transform and those above it.
        int NodeOf(Transform transform)
        {
            int found = transforms.IndexOf(transform);
            if (found >= 0) return found;
            int parent = transform.parent == null ? -1 : NodeOf(transform.parent);
            transforms.Add(transform);
            figure.Nodes.Add(new NodeSource { Name = transform.name, Parent = parent, Matrix = MatrixOf(transform) });
            return transforms.Count - 1;
        }

        float[] MatrixOf(Transform transform) { return Numbers(toFigure * transform.localToWorldMatrix); }
        float[] Direction(Vector3 world) { return Numbers(toFigure.MultiplyVector(world)); }

        static float[] Numbers(Vector3 vector) { return new[] { vector.x, vector.y, vector.z }; }
        static float[] Numbers(Matrix4x4 m) { return new[] { m.m00, m.m01, m.m02, m.m03, m.m10, m.m11, m.m12, m.m13, m.m20, m.m21, m.m22, m.m23, m.m30, m.m31, m.m32, m.m33 }; }
    }
}
