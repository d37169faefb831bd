// SPDX-License-Identifier: MIT
// Stub of Unity's skinned meshes, Cloth, colliders and clips: properties that a test sets. Defaults are Unity's.
using System;

namespace UnityEngine
{
    public struct BoneWeight
    {
        public int boneIndex0, boneIndex1, boneIndex2, boneIndex3;
        public float weight0, weight1, weight2, weight3;
    }

    public sealed class SkinnedMeshRenderer : Component
    {
        public Mesh sharedMesh { get; set; }
        public Transform[] bones { get; set; } = new Transform[0];
    }

    public struct ClothSkinningCoefficient
    {
        public float maxDistance, collisionSphereDistance;
    }

    public sealed class SphereCollider : Component
    {
        public Vector3 center { get; set; }
        public float radius { get; set; } = 0.5f;
    }

    public sealed class CapsuleCollider : Component
    {
        public Vector3 center { get; set; }
        public float radius { get; set; } = 0.5f;
        public float height { get; set; } = 2;
        public int direction { get; set; } = 1;
    }

    public struct ClothSphereColliderPair
    {
        public SphereCollider first { get; set; }
        public SphereCollider second { get; set; }
    }

    public sealed class Cloth : Component
    {
        public ClothSkinningCoefficient[] coefficients { get; set; } = new ClothSkinningCoefficient[0];
        public Vector3[] vertices { get; set; } = new Vector3[0];
        public CapsuleCollider[] capsuleColliders { get; set; } = new CapsuleCollider[0];
        public ClothSphereColliderPair[] sphereColliders { get; set; } = new ClothSphereColliderPair[0];
        public float stretchingStiffness { get; set; } = 1;
        public float bendingStiffness { get; set; }
        public float stiffnessFrequency { get; set; } = 10;
        public float damping { get; set; }
        public float friction { get; set; } = 0.5f;
        public float selfCollisionDistance { get; set; }
        public bool useTethers { get; set; } = true;
        public bool useGravity { get; set; } = true;
        public Vector3 externalAcceleration { get; set; }
        public Vector3 randomAcceleration { get; set; }
        public float worldVelocityScale { get; set; } = 0.5f;
        public float worldAccelerationScale { get; set; } = 1;
    }

    public static class Physics
    {
        public static Vector3 gravity { get; set; } = new Vector3(0, -9.81f, 0);
    }

    public sealed class Animator : Behaviour { }

    // A test gives the motion: what the clip does to the transforms at a time.
    public sealed class AnimationClip : Object
    {
        public Action<GameObject, float> Motion;
        public float length { get; set; }
    }
}
