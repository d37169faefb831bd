// SPDX-License-Identifier: MIT
// As follow.c, with the engine-free part of the package for Unity.
using System;
using System.IO;
using System.Threading;
using ClothStream.Core;

static unsafe class Follow
{
    // Milliseconds without a frame after which a paused scene has shown its last one.
    const int QuietMs = 2000;

    static ulong Fnv1a(byte[] data)
    {
        ulong hash = 0xcbf29ce484222325;
        foreach (byte value in data) hash = unchecked((hash ^ value) * 0x100000001b3);
        return hash;
    }

    // Bytes of the newest positions if their tick is not `tick`, else null.
    static byte[] NewPositions(Client client, ref ulong tick)
    {
        lock (client.Gate)
        {
            Statistics statistics = client.Statistics;
            if (statistics.frames == 0 || statistics.tick == tick) return null;
            tick = statistics.tick;
            var bytes = new byte[3 * sizeof(float) * client.VertexCount];
            fixed (byte* target = bytes) Buffer.MemoryCopy(client.Positions, target, bytes.Length, bytes.Length);
            return bytes;
        }
    }

    static int Main(string[] arguments)
    {
        var options = new ClientOptions { Address = arguments[0], Fingerprint = arguments[1], Token = File.ReadAllText(arguments[2]).Trim(), DisplayName = arguments[3] };
        using (var client = new Client(options))
        {
            byte[] last = null;
            ulong tick = 0;
            for (int quiet = 0; quiet < QuietMs || !client.Notice.Contains("paused"); Thread.Sleep(1), ++quiet)
            {
                if (client.State == State.Failed) throw new Exception(client.ErrorText);
                byte[] positions = NewPositions(client, ref tick);
                if (positions == null) continue;
                last = positions;
                quiet = 0;
                Console.WriteLine("frame {0} {1:x16}", tick, Fnv1a(positions));
            }
            File.WriteAllBytes(arguments[4], last);
        }
        return 0;
    }
}
