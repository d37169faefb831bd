// SPDX-License-Identifier: MIT
// Test program for the components, with the stub of the engine. Usage: SceneProgram.exe ADDRESS [PAIRING_CODE]
// With a code: pairs, and joins with the token that it got. Otherwise everything else.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Threading;
using ClothStream;
using ClothStream.Core;
using UnityEngine;
using UnityEngine.XR;
using UnityEngine.XR.Hands;

static unsafe class SceneProgram
{
    const int PatienceMs = 60000;

    static void Check(bool holds, string what)
    {
        if (!holds) throw new Exception("not so: " + what + "\n" + string.Join("\n", Debug.Lines));
    }

    // Runs frames of the engine until something is so.
    static void Await(Func<bool> holds, string what)
    {
        ulong end = Client.NowUs + 1000ul * PatienceMs;
        for (; !holds(); Thread.Sleep(5))
        {
            Check(Client.NowUs < end, what + " within " + PatienceMs + " ms");
            Scene.Frame();
        }
    }

    static bool IsNear(Vector3 a, Vector3 b)
    {
        return Vector3.Distance(a, b) < 1e-4f;
    }

    static bool Same(byte[] bytes, void* memory)
    {
        for (int i = 0; i < bytes.Length; ++i)
            if (bytes[i] != ((byte*)memory)[i]) return false;
        return true;
    }

    static void MirrorsCoordinates(ClothStreamConnection connection)
    {
        var half = (float)Math.Sqrt(0.5);
        connection.transform.localPosition = new Vector3(1, 2, 3);
        connection.transform.localRotation = new Quaternion(0, half, 0, half); // 90 degrees about y: z becomes x in Unity
        Check(IsNear(connection.FromStream(new Vector3(0, 0, -1)), new Vector3(2, 2, 3)), "-z of the stream is +z of the object");
        var point = new Vector3(0.3f, -0.2f, 0.7f);
        Check(IsNear(connection.ToStream(connection.FromStream(point)), point), "points return");
        // A rotation and its image turn a point and its image alike.
        var turn = new Quaternion(0.5f, -0.5f, 0.1f, 0.7f);
        float length = (float)Math.Sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z + turn.w * turn.w);
        turn = new Quaternion(turn.x / length, turn.y / length, turn.z / length, turn.w / length);
        Vector3 turned = connection.FromStream(turn * point) - connection.FromStream(new Vector3());
        Vector3 image = connection.FromStream(turn) * new Vector3(point.x, point.y, -point.z);
        Check(IsNear(turned, image), "rotations are mirrored as points are");
        Quaternion back = connection.ToStream(connection.FromStream(turn));
        Check(Math.Abs(back.x - turn.x) + Math.Abs(back.y - turn.y) + Math.Abs(back.z - turn.z) < 1e-5, "rotations return");
    }

    static void DrawsCloth(ClothStreamConnection connection, StreamedCloth cloth, Material[] materials)
    {
        Await(() => connection.IsJoined && cloth.Mesh.vertexCount > 0 && connection.Client.Statistics.frames > 5, "cloth is drawn");
        Client client = connection.Client;
        Mesh mesh = cloth.Mesh;
        lock (client.Gate)
        {
            Scene.Frame();
            Check(mesh.vertexCount == client.VertexCount && Same(mesh.Stream(0), client.ShownPositions), "the mesh has the bytes of the shown positions");
            Check(Same(mesh.Stream(1), client.ShownNormals), "and of their normals");
            int count;
            uint* triangles = client.Triangles(out count);
            Check(mesh.Indices.Length == 4 * count && Same(mesh.Indices, triangles), "and the triangles");
        }
        Check(mesh.subMeshCount == 2 && mesh.SubMesh(1).indexStart == 3 * 2 * 16 * 12 && mesh.SubMesh(1).indexCount == 3 * 2 * 8 * 10, "each cloth is a submesh");
        Check(BitConverter.ToSingle(mesh.Stream(2), 4) == 1 && BitConverter.ToSingle(mesh.Stream(2), 8 * 12) == 1, "it has texture coordinates");
        Check(mesh.IsDynamic && mesh.bounds.min.x < -0.5f && mesh.bounds.max.x > 0.5f, "bounds follow the cloth");
        IsShownAtItsPlace(connection, mesh, materials);
    }

    static void IsShownAtItsPlace(ClothStreamConnection connection, Mesh mesh, Material[] materials)
    {
        MeshRenderer renderer = Scene.Find<MeshRenderer>();
        Check(renderer.sharedMaterials.SequenceEqual(new[] { materials[0], materials[0] }), "cloths share the last material");
        Vector3 vertex = mesh.VertexAt(5);
        Check(IsNear(renderer.transform.TransformPoint(vertex), connection.FromStream(vertex)), "a vertex is where the conversion puts it");
        // Unity shows the side from which a triangle is clockwise in its left-handed system. That is the side of the cross
        // product of its edges, in object space, whatever the sign of the scale.
        Vector3[] corners = Enumerable.Range(0, 3).Select(i => mesh.VertexAt(BitConverter.ToInt32(mesh.Indices, 4 * i))).ToArray();
        Vector3 side = Vector3.Cross(corners[1] - corners[0], corners[2] - corners[0]);
        Check(Vector3.Dot(side, mesh.NormalAt(BitConverter.ToInt32(mesh.Indices, 0))) > 0, "normals point to the side that is shown");
    }

    static Collider[] Own(Client client)
    {
        var found = new List<Collider>();
        lock (client.Gate)
        {
            var collider = new Collider { version = Native.CS_COLLIDER_VERSION };
            for (uint i = 0; Native.cs_get_collider(client.Handle, i, &collider) != 0; ++i)
                if (collider.participantId == client.ParticipantId) found.Add(collider);
        }
        return found.ToArray();
    }

    static XRHand HandAt(Vector3 center, float pinch)
    {
        var joints = new XRHandJoint[27];
        for (int i = 0; i < joints.Length; ++i) joints[i] = new XRHandJoint { Position = center + new Vector3(0.2f + 0.01f * i, 0, 0), Radius = 0.008f };
        joints[(int)XRHandJointID.ThumbTip].Position = center - new Vector3(pinch / 2, 0, 0);
        joints[(int)XRHandJointID.IndexTip].Position = center + new Vector3(pinch / 2, 0, 0);
        return new XRHand { Joints = joints };
    }

    static void SendsHandsAndGrabs(ClothStreamConnection connection, StreamedCloth cloth)
    {
        Client client = connection.Client;
        XRHandSubsystem hands = SubsystemManager.Hands;
        // The lower right corner of the first cloth hangs free.
        Vector3 corner = connection.FromStream(cloth.Mesh.VertexAt(17 * 13 - 1));
        hands.leftHand = HandAt(corner, 0.1f);
        Await(() => Own(client).Length == 21, "20 bones and the head are colliders");
        hands.leftHand = HandAt(corner, 0.005f);
        Await(() => client.TakeGrabEvents().Any(grab => grab.kind == (uint)GrabEventKind.Taken && grab.vertices > 0), "a pinch grabs");
        hands.leftHand = new XRHand();
        Await(() => client.TakeGrabEvents().Any(grab => grab.kind == (uint)GrabEventKind.Released), "a lost hand lets go");
        Await(() => Own(client).Length == 1, "a lost hand has no bones");

        corner = connection.FromStream(cloth.Mesh.VertexAt(17 * 13 - 1));
        InputDevices.Devices[XRNode.RightHand] = new InputDevice { isValid = true, Position = corner };
        Await(() => Own(client).Length == 2, "a controller is a sphere");
        Collider sphere = Own(client).First(one => one.name != null && one.radius == 0.04f);
        Check(IsNear(connection.FromStream(new Vector3(sphere.position[0], sphere.position[1], sphere.position[2])), corner), "at its place");
        corner = connection.FromStream(cloth.Mesh.VertexAt(17 * 13 - 1));
        InputDevices.Devices[XRNode.RightHand] = new InputDevice { isValid = true, Position = corner, Trigger = 1 };
        Await(() => client.TakeGrabEvents().Any(grab => grab.kind == (uint)GrabEventKind.Taken), "a trigger grabs");
    }

    static GameObject Square(string name, Transform parent, float height)
    {
        var square = new GameObject(name, typeof(MeshFilter));
        square.transform.SetParent(parent, false);
        square.transform.localPosition = new Vector3(0, height, 0);
        // Its front is above: clockwise in Unity's left-handed system.
        square.GetComponent<MeshFilter>().sharedMesh = new Mesh
        {
            subMeshCount = 1,
            vertices = new[] { new Vector3(-2, 0, -2), new Vector3(-2, 0, 2), new Vector3(2, 0, 2), new Vector3(2, 0, -2) },
            triangles = new[] { 0, 1, 2, 0, 2, 3 }
        };
        return square;
    }

    static float Lowest(Client client)
    {
        float lowest = float.MaxValue;
        lock (client.Gate)
            for (int i = 0; i < client.VertexCount; ++i) lowest = Math.Min(lowest, client.Positions[3 * i + 1]);
        return lowest;
    }

    // A table of the real room that is 1.2 cm higher than the lower edges of the hanging cloth lifts them, since cloth that is
    // up to 3 cm behind a surface is pushed to its front. Edges that are let down swing to at most 2.4 cm below the table.
    // Cloth keeps at least 0.5 mm from it.
    static void LiesOnTheRoom(ClothStreamConnection connection)
    {
        Client client = connection.Client;
        float hangs = Lowest(client);
        var room = new GameObject("room").AddComponent<ClothStreamRoom>();
        Check(!room.enabled && Debug.Lines.Last().StartsWith("error ClothStream: ClothStream Room has no connection"), "a room without connection is an error");
        Debug.Lines.Clear();
        room.connection = connection;
        room.meshes = new GameObject("trackables").transform;
        room.meshes.SetParent(connection.transform, false);
        float height = hangs + 0.012f;
        GameObject table = Square("table", room.meshes, height), empty = Square("empty", room.meshes, 0);
        empty.GetComponent<MeshFilter>().sharedMesh = null;
        room.enabled = true;
        for (int i = 0; i < 200; ++i)
        {
            Scene.Frame();
            Thread.Sleep(5);
        }
        Check(room.Count == 0 && Lowest(client) < height, "nothing is sent before the user agrees");
        room.share = RoomSharing.Server;
        Await(() => Lowest(client) > height, "the cloth lies on the table");
        table.SetActive(false);
        Await(() => Lowest(client) < height - 0.006f, "a table that is gone lets the cloth down");
        table.SetActive(true);
        Await(() => Lowest(client) > height, "and holds it again");
        table.transform.localPosition = new Vector3(0, height - 1, 0);
        Await(() => Lowest(client) < height - 0.006f, "a table that is moved lets the cloth down");
        table.transform.localPosition = new Vector3(0, height, 0);
        Await(() => Lowest(client) > height, "and holds it when it is back");
        room.share = RoomSharing.NoOne;
        Await(() => room.Count == 0 && Lowest(client) < height - 0.006f, "all is taken back");
        UnityEngine.Object.Destroy(room.gameObject);
    }

    static void Pairs(string address, string code)
    {
        var stream = new GameObject("stream");
        var connection = stream.AddComponent<ClothStreamConnection>();
        connection.enabled = false;
        Debug.Lines.Clear();
        string token = "";
        connection.Paired += given => token = given;
        connection.address = address;
        connection.pairingCode = code;
        connection.enabled = true;
        Await(() => connection.IsJoined && token != "", "the code admits and gives a token");
        connection.enabled = false;
        connection.pairingCode = "";
        connection.enabled = true;
        Await(() => connection.Client.State == State.Failed, "the server refuses without a token");
        Check(connection.Client.ErrorCode == (uint)Errors.Unauthenticated, "because it is missing");
        connection.enabled = false;
        connection.token = token;
        connection.enabled = true;
        Await(() => connection.IsJoined, "the token admits");
    }

    static void Main(string[] arguments)
    {
        if (arguments.Length == 2)
        {
            Pairs(arguments[0], arguments[1]);
            return;
        }
        var material = new Material();
        var stream = new GameObject("stream");
        stream.SetActive(false);
        var connection = stream.AddComponent<ClothStreamConnection>();
        connection.address = arguments[0];
        connection.scene = "small";
        connection.role = Role.Participant;
        MirrorsCoordinates(connection);
        var cloth = stream.AddComponent<StreamedCloth>();
        cloth.materials = new[] { material };
        var input = stream.AddComponent<ClothStreamInput>();
        input.head = new GameObject("head").transform;
        input.head.localPosition = new Vector3(0, 3, 5);
        input.grabReach = 0.2f;
        Check(connection.Client == null, "an inactive object does not connect");
        stream.SetActive(true);

        DrawsCloth(connection, cloth, cloth.materials);
        SendsHandsAndGrabs(connection, cloth);
        LiesOnTheRoom(connection);
        Check(Debug.Lines.Count == 0, "nothing is logged");

        Client client = connection.Client;
        input.enabled = false;
        Await(() => Own(client).Length == 0, "disabled input takes its colliders away");
        stream.SetActive(false);
        Check(connection.Client == null && cloth.Mesh == null && Scene.Find<MeshRenderer>() == null, "a disabled object has neither client nor mesh");
        stream.SetActive(true);
        DrawsCloth(connection, cloth, cloth.materials);

        RunsTheSample(arguments[0]);
        ReportsErrors();
    }

    static void RunsTheSample(string address)
    {
        var room = new GameObject("room");
        room.SetActive(false);
        room.AddComponent<ClothInARoom>().address = address;
        room.SetActive(true);
        Await(() => Debug.Lines.Any(line => line.StartsWith("log Joined ")), "the sample joins");
        room.SetActive(false);
        Debug.Lines.Clear();
    }

    static void ReportsErrors()
    {
        var other = new GameObject("other");
        var connection = other.AddComponent<ClothStreamConnection>();
        connection.enabled = false;
        connection.address = "host:0";
        connection.enabled = true;
        Check(!connection.enabled && Debug.Lines.Single().StartsWith("error ClothStream: The address \"host:0\" has no valid port"), "a wrong address is an error");
        Debug.Lines.Clear();
        connection.address = "127.0.0.1:1";
        connection.enabled = true;
        Await(() => Debug.Lines.Count > 0, "a server that is away is reported");
        Check(Debug.Lines[0].StartsWith("warning ClothStream: No connection to the server at 127.0.0.1:1"), "as a warning");
        UnityEngine.Object.Destroy(other);
        new GameObject("alone").AddComponent<StreamedCloth>();
        Check(Debug.Lines.Last().StartsWith("error ClothStream: Streamed Cloth has no connection"), "a cloth without connection is an error");
    }
}
