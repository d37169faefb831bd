// SPDX-License-Identifier: MIT
// Addresses of servers, as users write them.
using System;
using System.Net;

namespace ClothStream.Core
{
    /// <summary>
    /// HOST or HOST:PORT of the server's page; the default port is 8080. wss:// or https:// before it means TLS; ws:// or
    /// http:// means no TLS and is the default. A v6 address with a port has brackets.
    /// </summary>
    public sealed class ServerAddress
    {
        const int DefaultPort = 8080;

        public string Host { get; }
        public int Port { get; }
        public bool IsEncrypted { get; }

        /// <exception cref="ArgumentException">The text is not an address. The message says why.</exception>
        public ServerAddress(string text)
        {
            string rest = (text ?? "").Trim();
            foreach (string scheme in new[] { "wss://", "https://", "ws://", "http://" })
            {
                if (!rest.StartsWith(scheme, StringComparison.OrdinalIgnoreCase)) continue;
                IsEncrypted = scheme == "wss://" || scheme == "https://";
                rest = rest.Substring(scheme.Length);
                if (rest.EndsWith("/", StringComparison.Ordinal)) rest = rest.Substring(0, rest.Length - 1);
                break;
            }
            int port = DefaultPort;
            int colon = rest.LastIndexOf(':');
            bool isBareV6 = colon >= 0 && rest.IndexOf(':') != colon && !rest.StartsWith("[", StringComparison.Ordinal);
            bool endsWithBracket = rest.EndsWith("]", StringComparison.Ordinal);
            if (colon >= 0 && !isBareV6 && !endsWithBracket)
            {
                if (!int.TryParse(rest.Substring(colon + 1), out port) || port < 1 || port > 65535)
                    throw new ArgumentException("The address \"" + text + "\" has no valid port after the host; use 1 to 65535.");
                rest = rest.Substring(0, colon);
            }
            Host = rest.TrimStart('[').TrimEnd(']');
            Port = port;
            if (Uri.CheckHostName(Host) == UriHostNameType.Unknown)
                throw new ArgumentException("The address \"" + text + "\" has no host; use HOST or HOST:PORT.");
        }

        ServerAddress(string host, int port, bool isEncrypted)
        {
            Host = host;
            Port = port;
            IsEncrypted = isEncrypted;
        }

        /// <summary>The address with a DNS name in place of the host; "" means unchanged.</summary>
        public ServerAddress At(string name)
        {
            return name == "" ? this : new ServerAddress(name, Port, IsEncrypted);
        }

        /// <summary>Whether the server runs on this machine: localhost or a loopback address.</summary>
        public bool IsLoopback
        {
            get
            {
                IPAddress address;
                return Host == "localhost" || (IPAddress.TryParse(Host, out address) && IPAddress.IsLoopback(address));
            }
        }

        /// <summary>The address of the stream.</summary>
        public Uri Stream
        {
            get
            {
                string host = Uri.CheckHostName(Host) == UriHostNameType.IPv6 ? "[" + Host + "]" : Host;
                return new Uri((IsEncrypted ? "wss://" : "ws://") + host + ":" + Port + "/stream");
            }
        }

        public override string ToString()
        {
            return (IsEncrypted ? "wss://" : "") + Stream.Authority;
        }
    }
}
