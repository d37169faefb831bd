// SPDX-License-Identifier: MIT
// Opens a WebSocket over a stream (RFC 6455, section 4.1). ClientWebSocket of Mono and Unity calls no certificate callback
// (github.com/mono/mono/issues/8660), so a key could not be pinned with it. The frames are those of System.Net.WebSockets.
using System;
using System.IO;
using System.Net.WebSockets;
using System.Security.Cryptography;
using System.Text;
using System.Threading;
using System.Threading.Tasks;

namespace ClothStream.Core
{
    static class WebSocketUpgrade
    {
        const string Guid = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
        const int MaxHeaderBytes = 8192, MaxShownBytes = 300, BufferBytes = 16 << 10;

        /// <exception cref="InvalidDataException">The server refuses, or it is not a server of this kind. The message says
        /// why.</exception>
        public static async Task<WebSocket> Open(Stream stream, Uri address)
        {
            var random = new byte[16];
            using (RandomNumberGenerator generator = RandomNumberGenerator.Create()) generator.GetBytes(random);
            string key = Convert.ToBase64String(random);
            byte[] request = Encoding.ASCII.GetBytes("GET " + address.AbsolutePath + " HTTP/1.1\r\nHost: " + address.Authority +
                                                     "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + key + "\r\n\r\n");
            await stream.WriteAsync(request, 0, request.Length).ConfigureAwait(false);
            string[] lines = await ReadHeader(stream).ConfigureAwait(false);
            string[] status = lines[0].Split(new[] { ' ' }, 3);
            if (status.Length < 2 || !status[0].StartsWith("HTTP/1.", StringComparison.Ordinal))
                throw new InvalidDataException("another program answers, not a clothstream-server; use the port of its page");
            if (status[1] != "101") throw new InvalidDataException(await Refusal(stream, lines, status).ConfigureAwait(false));
            if (Field(lines, "Sec-WebSocket-Accept") != AnswerTo(key)) throw new InvalidDataException("the server does not answer as a WebSocket");
            return WebSocket.CreateClientWebSocket(stream, null, BufferBytes, BufferBytes, Timeout.InfiniteTimeSpan, false,
                                                   WebSocket.CreateClientBuffer(BufferBytes, BufferBytes));
        }

        static string AnswerTo(string key)
        {
            using (SHA1 sha = SHA1.Create()) return Convert.ToBase64String(sha.ComputeHash(Encoding.ASCII.GetBytes(key + Guid)));
        }

        // Reads no byte beyond the header.
        static async Task<string[]> ReadHeader(Stream stream)
        {
            var header = new StringBuilder();
            var next = new byte[1];
            while (header.Length < 4 || header.ToString(header.Length - 4, 4) != "\r\n\r\n")
            {
                if (header.Length == MaxHeaderBytes) throw new InvalidDataException("the server answers with a header of more than 8 KiB");
                if (await stream.ReadAsync(next, 0, 1).ConfigureAwait(false) == 0) throw new InvalidDataException("the server has ended the connection before its answer");
                header.Append((char)next[0]);
            }
            return header.ToString().Split(new[] { "\r\n" }, StringSplitOptions.RemoveEmptyEntries);
        }

        static string Field(string[] lines, string name)
        {
            foreach (string line in lines)
                if (line.StartsWith(name + ":", StringComparison.OrdinalIgnoreCase)) return line.Substring(name.Length + 1).Trim();
            return "";
        }

        // The reason of the server: the first line of the body, else that of the status.
        static async Task<string> Refusal(Stream stream, string[] lines, string[] status)
        {
            int length;
            int.TryParse(Field(lines, "Content-Length"), out length);
            var body = new byte[Math.Max(0, Math.Min(length, MaxShownBytes))];
            int read = 0;
            for (int more = 1; more > 0 && read < body.Length; read += more) more = await stream.ReadAsync(body, read, body.Length - read).ConfigureAwait(false);
            string text = Encoding.UTF8.GetString(body, 0, read).Split('\r', '\n')[0];
            if (text == "" && status.Length > 2) text = status[2];
            return "it refuses with HTTP status " + status[1] + " (" + text + ")";
        }
    }
}
