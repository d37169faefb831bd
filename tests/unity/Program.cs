// SPDX-License-Identifier: MIT
// Test program for the engine-free part of the Unity package. Usage: Program.exe COMMAND ADDRESS [ARGUMENTS]
//   follow: prints "frame TICK HASH" for each frame until the standard input ends
//   input: moves a hand, grabs a cloth, changes the wind, sees another participant
//   return: joins, prints "joined", and waits until the connection was lost and is back
//   secure FINGERPRINT TOKEN: joins over TLS
//   refused FINGERPRINT TOKEN: prints why the client failed
//   problem: prints why there is no connection
//   parts: everything that needs no server; ADDRESS has no meaning
// Throws, and so returns 1, if a check fails.
using System;
using System.Threading;
using ClothStream.Core;
using Environment = ClothStream.Core.Environment;

static unsafe class Program
{
    const int PatienceMs = 60000;

    static void Check(bool holds, string what)
    {
        if (!holds) throw new Exception("not so: " + what);
    }

    // Waits for what comes from the server.
    static void Await(Client client, Func<bool> holds, string what)
    {
        ulong end = Client.NowUs + 1000ul * PatienceMs;
        while (!holds())
        {
            Check(client.State != State.Failed, what + ": " + client.ErrorText);
            Check(Client.NowUs < end, what + " within " + PatienceMs + " ms; " + client.Problem);
            Thread.Sleep(2);
        }
    }

    static Client Join(string address, string name = "Sharp", string fingerprint = "", string token = "")
    {
        var client = new Client(new ClientOptions { Address = address, Scene = "small", DisplayName = name, Role = Role.Participant, Fingerprint = fingerprint, Token = token });
        Await(client, () => client.State == State.Joined, "joins");
        return client;
    }

    static ulong Fnv1a(float* values, int count)
    {
        ulong hash = 0xcbf29ce484222325;
        byte* data = (byte*)values;
        for (int i = 0; i < 4 * count; ++i) hash = unchecked((hash ^ data[i]) * 0x100000001b3);
        return hash;
    }

    // Prints the newest frame if its tick is not `tick`.
    static bool PrintFrame(Client client, ref ulong tick)
    {
        lock (client.Gate)
        {
            Statistics statistics = client.Statistics;
            if (statistics.frames == 0 || statistics.tick == tick) return false;
            tick = statistics.tick;
            Console.WriteLine("frame {0} {1:x16}", tick, Fnv1a(client.Positions, 3 * client.VertexCount));
            return true;
        }
    }

    static void Follow(string address)
    {
        using (Client client = Join(address, "watcher"))
        {
            Check(client.SceneName == "small" && client.StreamRate == 60 && client.Role >= Role.Participant, "the scene is described");
            ClothRange[] cloths = client.Cloths;
            Check(cloths.Length == 2 && cloths[1].Name == "right" && cloths[1].FirstVertex == 17 * 13 && cloths[1].Columns == 11, "it has two cloths");
            int indices;
            lock (client.Gate) client.Triangles(out indices);
            Check(indices == 3 * 2 * (16 * 12 + 8 * 10), "they have triangles");
            var uvs = new float[2 * cloths[1].VertexCount];
            fixed (float* first = uvs) client.TextureCoordinates(1, first);
            Check(uvs[0] == 0 && uvs[1] == 1 && uvs[20] == 1 && uvs[21] == 1 && uvs[uvs.Length - 1] == 0, "texture coordinates cover a grid");
            var input = new Thread(() => Console.In.ReadToEnd());
            input.Start();
            for (ulong tick = 0; input.IsAlive; Thread.Sleep(1)) PrintFrame(client, ref tick);
            Statistics statistics = client.Statistics;
            Check(statistics.hashMismatches == 0 && statistics.decodeErrors == 0, "frames are those of the server");
            Check(client.Hash != 0, "the frame has a hash");
        }
    }

    static void Input(string address)
    {
        using (Client client = Join(address))
        using (Client other = Join(address))
        {
            Await(client, () => client.People.Length == 2, "the other participant is listed");
            Check(client.People[1].Name == "Sharp" && client.People[1].ClientName == "ClothStream for Unity" && client.People[0].Id == client.ParticipantId, "with its names");
            PresenceChange[] changes = client.TakePresence();
            Check(changes.Length == 1 && changes[0].Kind == PresenceKind.Joined && changes[0].Person.Id == other.ParticipantId, "it was announced once");

            client.StartPlayOut();
            client.SetLocalContact(true);
            Await(client, () => client.Play(Client.NowUs).shown >= (uint)Shown.Frame, "play-out shows frames");

            var joints = new float[4 * 26];
            for (int i = 0; i < 26; ++i) joints[4 * i] = 3 + 0.01f * i;
            for (int i = 0; i < 26; ++i) joints[4 * i + 3] = 0.01f;
            client.SetHand(HandSide.Left, joints, Client.NowUs);
            client.SetHead(new[] { 0f, 1.7f, 1f }, null, 0.1f, Client.NowUs);
            Await(client, () => ForeignColliders(other) == 21, "the other sees 20 bones and a head");
            bool threw = false;
            try { client.SetHand(HandSide.Left, new float[8], Client.NowUs); }
            catch (ArgumentException) { threw = true; }
            Check(threw, "a hand with 2 joints is refused");

            GrabCloth(client, other);

            ChangeParameters(client, other);

            other.Dispose();
            Await(client, () => client.People.Length == 1, "who leaves is gone at once");
            threw = false;
            try { Check(other.VertexCount > 0, "a disposed client has no vertices"); }
            catch (ObjectDisposedException) { threw = true; }
            Check(threw, "a disposed client refuses");
        }
    }

    static void ChangeParameters(Client client, Client other)
    {
        Check(Wind(client, 2) == 2, "the wind is that of the scene");
        client.SetEnvironment(null, new[] { 1f, 0, 0 }, null);
        Await(other, () => Wind(other, 0) == 1, "the wind changes for all");
        ClothSettings settings = Client.KeepClothSettings();
        settings.damping = 0.75f;
        Check(client.ChangeCloth("right", settings) && !client.ChangeCloth("none", settings), "only known cloths change");
        Await(other, () => Damping(other) == 0.75f, "the damping changes for all");
    }

    static float Wind(Client client, int axis)
    {
        Environment environment;
        Check(client.TryGetEnvironment(out environment), "there is an environment");
        return environment.wind[axis];
    }

    static float Damping(Client client)
    {
        ClothSettings settings;
        Check(client.TryGetClothSettings(1, out settings), "the second cloth has settings");
        return settings.damping;
    }

    // Colliders of another participant, as this client sees them.
    static int ForeignColliders(Client client)
    {
        int count = 0;
        lock (client.Gate)
        {
            var collider = new Collider { version = Native.CS_COLLIDER_VERSION };
            for (uint i = 0; Native.cs_get_collider(client.Handle, i, &collider) != 0; ++i)
                if (collider.participantId != 0 && collider.participantId != client.ParticipantId) ++count;
        }
        return count;
    }

    static void GrabCloth(Client client, Client other)
    {
        // The lower edge of the left cloth hangs free.
        ClothRange cloth = client.Cloths[0];
        var corner = new float[3];
        lock (client.Gate)
            for (int i = 0; i < 3; ++i) corner[i] = client.ShownPositions[3 * (cloth.FirstVertex + cloth.VertexCount - 1) + i];
        var orientation = new[] { 0f, 0, 0, 1 };
        var pinch = new PinchGrab(0) { Reach = 0.2f };
        pinch.Update(client, 0.6f, corner, orientation);
        Check(!pinch.IsHolding, "a weak pinch does not grab");
        pinch.Update(client, 0.9f, new[] { 9f, 9, 9 }, orientation);
        Check(!pinch.IsHolding, "a pinch far from cloth does not grab");
        pinch.Update(client, 0.9f, corner, orientation);
        Check(!pinch.IsHolding, "a closed pinch does not begin to grab on its way");
        pinch.Update(client, 0, corner, orientation);
        pinch.Update(client, 0.9f, corner, orientation);
        Check(pinch.IsHolding, "a pinch near cloth grabs");
        uint id = pinch.Grab.id;
        pinch.Update(client, 0.6f, corner, orientation);
        Check(pinch.IsHolding && pinch.Grab.id == id, "a weaker pinch holds on");
        client.SetGrabs(new[] { pinch.Grab }, new[] { pinch.Place }, 1, Client.NowUs);
        AwaitGrab(other, id, GrabEventKind.Taken);
        pinch.Update(client, 0.3f, corner, orientation);
        Check(!pinch.IsHolding, "an open hand lets go");
        client.SetGrabs(new Grab[0], null, 0, Client.NowUs);
        AwaitGrab(other, id, GrabEventKind.Released);
    }

    static void AwaitGrab(Client client, uint id, GrabEventKind kind)
    {
        Await(client, () => Array.Exists(client.TakeGrabEvents(), grab => grab.grabId == id && grab.kind == (uint)kind), "the server says " + kind);
    }

    static void Return(string address)
    {
        using (Client client = Join(address))
        {
            ulong id = client.ParticipantId, tick = 0;
            Await(client, () => PrintFrame(client, ref tick), "a frame comes");
            Console.WriteLine("joined");
            Await(client, () => client.State == State.Reconnecting, "the connection is lost");
            Check(client.VertexCount > 0, "the last frame stays");
            Await(client, () => client.Problem != "", "the client says why");
            Console.WriteLine("lost: " + client.Problem);
            Await(client, () => client.State == State.Joined && client.Problem == "", "the client is back");
            Check((client.TakeEvents() & Events.Returned) != 0, "with an event");
            Await(client, () => PrintFrame(client, ref tick), "frames come again");
            Console.WriteLine("returned");
        }
    }

    static void Secure(string address, string fingerprint, string token)
    {
        using (Client client = Join(address, "Sharp", fingerprint, token))
        {
            ulong tick = 0;
            Await(client, () => PrintFrame(client, ref tick), "a frame comes");
        }
    }

    static void Refused(string address, string fingerprint, string token)
    {
        using (var client = new Client(new ClientOptions { Address = address, Fingerprint = fingerprint, Token = token }))
        {
            ulong end = Client.NowUs + 1000ul * PatienceMs;
            while (client.State != State.Failed)
            {
                Check(Client.NowUs < end, "the client gives up; " + client.Problem);
                Thread.Sleep(2);
            }
            Console.WriteLine("refused {0}: {1}", client.ErrorCode, client.ErrorText);
        }
    }

    static void PrintProblem(string address)
    {
        using (var client = new Client(new ClientOptions { Address = address }))
        {
            Await(client, () => client.Problem != "", "there is a problem");
            Console.WriteLine(client.Problem);
        }
    }

    static void Main(string[] arguments)
    {
        string address = arguments[1];
        switch (arguments[0])
        {
            case "follow": Follow(address); break;
            case "input": Input(address); break;
            case "return": Return(address); break;
            case "secure": Secure(address, arguments[2], arguments[3]); break;
            case "refused": Refused(address, arguments[2], arguments[3]); break;
            case "problem": PrintProblem(address); break;
            case "parts": Parts.Run(); break;
            default: throw new ArgumentException("unknown command " + arguments[0]);
        }
    }
}
