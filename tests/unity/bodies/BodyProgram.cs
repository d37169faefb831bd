// SPDX-License-Identifier: MIT
// Test program for bodies that are worn, with the stub of the engine. Usage: BodyProgram.exe ADDRESS
// The server has the scene "walker".
using System;
using System.Linq;
using System.Threading;
using ClothStream;
using ClothStream.Core;
using UnityEngine;
using UnityEngine.XR;
using UnityEngine.XR.Hands;

static class BodyProgram
{
    const int PatienceMs = 60000;
    // Radius of the avatar's arm, and the distance of its vertices, m.
    const float Arm = 0.07f;

    static void Check(bool holds, string what)
    {
        if (!holds) throw new Exception("not so: " + what + "\n" + string.Join("\n", Debug.Lines));
    }

    static void Await(Func<bool> holds, string what)
    {
        ulong end = Client.NowUs + 1000ul * PatienceMs;
        for (; !holds(); Thread.Sleep(5))
        {
            Check(Client.NowUs < end, what + " within " + PatienceMs + " ms");
            Scene.Frame();
        }
    }

    // A joined connection that draws bodies. Its origin is elsewhere in the world, and turned by 90 degrees.
    static StreamedBodies Join(string address, string name)
    {
        var half = (float)Math.Sqrt(0.5);
        var stream = new GameObject(name);
        stream.SetActive(false);
        stream.transform.localPosition = new Vector3(10, 1, -4);
        stream.transform.localRotation = new Quaternion(0, half, 0, half);
        var connection = stream.AddComponent<ClothStreamConnection>();
        connection.address = address;
        connection.scene = "walker";
        connection.role = Role.Participant;
        var bodies = stream.AddComponent<StreamedBodies>();
        stream.SetActive(true);
        Await(() => connection.IsJoined && bodies.MeshOf("avatar") != null && bodies.MeshOf("avatar").vertexCount > 1000, "the body is drawn");
        return bodies;
    }

    static GameObject Drawn(StreamedBodies bodies)
    {
        return Scene.Objects.First(one => one.GetComponent<MeshFilter>() != null && ReferenceEquals(one.GetComponent<MeshFilter>().sharedMesh, bodies.MeshOf("avatar")));
    }

    // Distance (m) from a point in the world to the nearest vertex of the drawn body.
    static float DistanceTo(StreamedBodies bodies, Vector3 point)
    {
        Mesh mesh = bodies.MeshOf("avatar");
        Transform transform = Drawn(bodies).transform;
        float nearest = float.MaxValue;
        for (int i = 0; i < mesh.vertexCount; ++i) nearest = Math.Min(nearest, Vector3.Distance(transform.TransformPoint(mesh.VertexAt(i)), point));
        return nearest;
    }

    static XRHand HandAt(Vector3 wrist)
    {
        var joints = new XRHandJoint[27];
        for (int i = 0; i < joints.Length; ++i) joints[i] = new XRHandJoint { Position = wrist + new Vector3(0, 0, 0.01f * i), Radius = 0.008f };
        joints[(int)XRHandJointID.Wrist].Position = wrist;
        return new XRHand { Joints = joints };
    }

    static void Main(string[] arguments)
    {
        StreamedBodies own = Join(arguments[0], "own"), other = Join(arguments[0], "other");
        ClothStreamConnection connection = own.connection;
        int all = own.MeshOf("avatar").Indices.Length;
        Check(own.MeshOf("floor") == null, "only bodies are drawn");

        var input = own.gameObject.AddComponent<ClothStreamInput>();
        input.head = new GameObject("head").transform;
        // Two metres before the origin, which is -z in the stream, and away from where the avatar walks.
        input.head.localPosition = connection.FromStream(new Vector3(0, 1.6f, -2.5f));
        input.body = "nobody";
        Await(() => Debug.Lines.Count > 0, "a wrong name is reported");
        Check(Debug.Lines.Single() == "warning ClothStream: The scene has no body \"nobody\". Use avatar.", "with the right ones");
        Check(!input.IsWearing, "and nothing is worn");
        Debug.Lines.Clear();

        // The head has no rotation in the world, so that it looks along z: the person faces -x of the stream.
        Vector3 hand = input.head.position + new Vector3(0.25f, -0.35f, 0.3f);
        SubsystemManager.Hands.rightHand = HandAt(hand);
        input.body = "avatar";
        Await(() => input.IsWearing && connection.Client.BodyOf(connection.Client.ParticipantId) == "avatar", "the body is taken");
        Await(() => own.MeshOf("avatar").Indices.Length < all && own.MeshOf("avatar").Indices.Length > all / 2, "the own body has no head");
        foreach (StreamedBodies seen in new[] { own, other }) Await(() => DistanceTo(seen, hand) < Arm, "the wrist is at the hand");
        Check(other.MeshOf("avatar").Indices.Length == all, "others see it whole");
        Vector3 feet = connection.ToStream(input.head.position);
        Await(() => DistanceTo(other, connection.FromStream(new Vector3(feet.x, 0.05f, feet.z))) < 0.3f, "the feet are on the floor");
        // Normals point outwards: away from the middle of the head's height, at the crown.
        Mesh mesh = other.MeshOf("avatar");
        int crown = Enumerable.Range(0, mesh.vertexCount).OrderByDescending(i => mesh.VertexAt(i).y).First();
        Check(mesh.NormalAt(crown).y > 0.5f, "normals point outwards");

        SubsystemManager.Hands.rightHand = new XRHand();
        Vector3 grip = input.head.position + new Vector3(0.3f, -0.4f, 0.2f);
        InputDevices.Devices[XRNode.RightHand] = new InputDevice { isValid = true, Position = grip };
        // The grip has no rotation: its -y, where the arm is, is -y of the world.
        Await(() => DistanceTo(other, grip - new Vector3(0, 0.08f, 0)) < Arm, "the wrist is below the grip");
        Check(Debug.Lines.Count == 0, "nothing is logged");

        input.body = "";
        Await(() => !input.IsWearing && other.connection.Client.BodyOf(connection.Client.ParticipantId) == "", "it is given back");
        Await(() => own.MeshOf("avatar").Indices.Length == all, "and drawn whole again");
        input.body = "avatar";
        Await(() => input.IsWearing, "it is taken again");
        input.enabled = false;
        Await(() => other.connection.Client.BodyOf(connection.Client.ParticipantId) == "", "disabled input gives it back");
        own.enabled = false;
        Check(own.MeshOf("avatar") == null, "a disabled component draws nothing");
    }
}
