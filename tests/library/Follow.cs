// SPDX-License-Identifier: MIT
// Test program in C#: follows a stream through libclothstream by P/Invoke. Usage: Follow.exe ADDRESS
// Prints "frame TICK HASH" for each decoded frame.
using System;
using System.Runtime.InteropServices;
using System.Text;

static unsafe class Follow
{
    enum Result { Ok, Invalid, Unreachable, Refused, Lost, Failed }

    [StructLayout(LayoutKind.Sequential)]
    struct Options
    {
        public uint version, role, quality;
        public IntPtr scene, clientName, displayName;
        public uint joinTimeoutMs, reconnectForMs;
        public IntPtr token, caFile, fingerprint, log, logContext;
        public uint transport;
    }

    [StructLayout(LayoutKind.Sequential)]
    struct Statistics
    {
        public uint version;
        public ulong tick, frames, keyFrames, dropped, decodeErrors, bytes, hashMismatches;
        public double framesPerSecond, kbitPerSecond, bitsPerVertex, roundTripMs, clockOffsetUs, decodeMs;
    }

    [StructLayout(LayoutKind.Sequential)]
    struct Collider
    {
        public uint version, shape;
        public IntPtr name;
        public ulong participantId;
        public fixed float position[3];
        public fixed float orientation[4];
        public float radius, length;
        public fixed float size[3];
        public float topRadius;
        public int yields;
    }

    [StructLayout(LayoutKind.Sequential)]
    struct OwnCollider
    {
        public uint version, shape;
        public fixed float position[3];
        public fixed float orientation[4];
        public float radius, length;
        public fixed float size[3];
        public float topRadius;
    }

    [StructLayout(LayoutKind.Sequential)]
    struct PlayOutOptions
    {
        public uint version, frames;
        public double delayMs, leastDelayMs, mostDelayMs, leadMs;
    }

    [StructLayout(LayoutKind.Sequential)]
    struct Played
    {
        public uint version, shown;
        public ulong tick, serverTimeUs;
        public double fraction;
    }

    const string Library = "clothstream";
    [DllImport(Library)] static extern void clothstream_default_options(out Options options);
    [DllImport(Library)] static extern Result clothstream_open(byte[] address, ref Options options, out IntPtr stream);
    [DllImport(Library)] static extern void clothstream_close(IntPtr stream);
    [DllImport(Library)] static extern Result clothstream_wait(IntPtr stream, uint timeoutMs, out uint events);
    [DllImport(Library)] static extern IntPtr clothstream_acquire(IntPtr stream);
    [DllImport(Library)] static extern void clothstream_release(IntPtr stream);
    [DllImport(Library)] static extern ulong clothstream_now_us();
    [DllImport(Library)] static extern IntPtr clothstream_error_text();
    [DllImport(Library)] static extern uint cs_vertex_count(IntPtr client);
    [DllImport(Library)] static extern float* cs_positions(IntPtr client);
    [DllImport(Library)] static extern int cs_get_statistics(IntPtr client, ulong nowUs, ref Statistics statistics);
    [DllImport(Library)] static extern int cs_get_collider(IntPtr client, uint index, ref Collider collider);
    [DllImport(Library)] static extern ulong cs_participant_id(IntPtr client);
    [DllImport(Library)] static extern int cs_set_colliders(IntPtr client, ref OwnCollider colliders, uint count, ulong nowUs);
    [DllImport(Library)] static extern void cs_default_play_out(out PlayOutOptions options);
    [DllImport(Library)] static extern int cs_set_play_out(IntPtr client, ref PlayOutOptions options);
    [DllImport(Library)] static extern int cs_play_out(IntPtr client, ulong nowUs, ulong displayUs, ref Played played);
    [DllImport(Library)] static extern float* cs_played_positions(IntPtr client);

    static void Check(bool holds, string what)
    {
        if (!holds) throw new Exception("not so: " + what + " (" + Marshal.PtrToStringAnsi(clothstream_error_text()) + ")");
    }

    static byte[] Utf8(string text)
    {
        return Encoding.UTF8.GetBytes(text + "\0");
    }

    static ulong Fnv1a(float* values, uint count)
    {
        ulong hash = 0xcbf29ce484222325;
        byte* data = (byte*)values;
        for (uint i = 0; i < 4 * count; ++i) hash = unchecked((hash ^ data[i]) * 0x100000001b3);
        return hash;
    }

    static bool HasOwn(IntPtr client, OwnCollider sphere)
    {
        var collider = new Collider { version = 1 };
        for (uint i = 0; cs_get_collider(client, i, ref collider) != 0; ++i)
            if (collider.participantId == cs_participant_id(client) && collider.position[0] == sphere.position[0] &&
                collider.position[1] == sphere.position[1] && collider.position[2] == sphere.position[2] &&
                collider.radius == sphere.radius)
                return true;
        return false;
    }

    static void Main(string[] arguments)
    {
        Options options;
        IntPtr stream;
        clothstream_default_options(out options);
        Check(options.version == 3 && options.transport == 0 && options.joinTimeoutMs == 10000, "options are as the header says");
        options.joinTimeoutMs = 3000;
        Check(clothstream_open(Utf8("127.0.0.1:1"), ref options, out stream) == Result.Unreachable, "an unreachable server is reported");
        Check(stream == IntPtr.Zero, "there is no stream");
        Check(Marshal.PtrToStringAnsi(clothstream_error_text()).Contains("127.0.0.1:1"), "the error names the address");

        clothstream_default_options(out options);
        IntPtr scene = Marshal.StringToHGlobalAnsi("small"), name = Marshal.StringToHGlobalAnsi("Sharp");
        options.scene = scene;
        options.displayName = name;
        options.role = 2;
        Check(clothstream_open(Utf8(arguments[0]), ref options, out stream) == Result.Ok, "it joins");
        Marshal.FreeHGlobal(scene);
        Marshal.FreeHGlobal(name);

        var sphere = new OwnCollider { version = 1, radius = 0.5f };
        sphere.position[0] = 0.75f;
        sphere.position[1] = 3.75f;
        sphere.position[2] = -0.25f;
        PlayOutOptions playOut;
        cs_default_play_out(out playOut);
        Check(playOut.version == 1 && double.IsNaN(playOut.delayMs), "the delay adapts");
        IntPtr client = clothstream_acquire(stream);
        Check(cs_set_play_out(client, ref playOut) == 1, "play-out is on");
        Check(cs_set_colliders(client, ref sphere, 1, clothstream_now_us()) == 1, "the sphere is sent");
        clothstream_release(stream);

        ulong tick = 0, hash = 0, shownUs = 0, endUs = clothstream_now_us() + 60000000;
        int frames = 0, moved = 0;
        bool seen = false;
        var statistics = new Statistics { version = 1 };
        while (frames < 60 || !seen)
        {
            uint events;
            Check(clothstream_now_us() < endUs, "frames and the collider come");
            Check(clothstream_wait(stream, 1000, out events) == Result.Ok, "the stream goes on");
            client = clothstream_acquire(stream);
            uint count = 3 * cs_vertex_count(client);
            Check(cs_get_statistics(client, clothstream_now_us(), ref statistics) == 1, "there are statistics");
            if (statistics.frames > 0 && statistics.tick != tick)
            {
                float* positions = cs_positions(client);
                for (uint i = 0; i < count; ++i) Check(Math.Abs(positions[i]) < 5, "vertices are near");
                ulong now = Fnv1a(positions, count);
                Console.WriteLine("frame {0} {1:x16}", statistics.tick, now);
                if (now != hash) ++moved;
                hash = now;
                tick = statistics.tick;
                ++frames;
            }
            var played = new Played { version = 1 };
            ulong nowUs = clothstream_now_us();
            Check(cs_play_out(client, nowUs, nowUs, ref played) == 1, "it plays");
            Check(played.serverTimeUs >= shownUs, "time goes on");
            shownUs = played.serverTimeUs;
            float* shown = cs_played_positions(client);
            for (uint i = 0; i < count; ++i) Check(Math.Abs(shown[i]) < 6, "what is shown is near");
            seen = seen || HasOwn(client, sphere);
            clothstream_release(stream);
        }
        Check(moved > 30, "the cloth moves");
        Check(shownUs > 0, "the server's clock is known");
        Check(statistics.hashMismatches == 0 && statistics.decodeErrors == 0, "frames are those of the server");
        clothstream_close(stream);
    }
}
