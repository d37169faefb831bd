// SPDX-License-Identifier: MIT
// One connection to the server: TCP, TLS and WebSocket. All members are for one thread. Tasks set an event when they have
// ended; Poll then takes their results.
using System;
using System.IO;
using System.Net.Security;
using System.Net.Sockets;
using System.Net.WebSockets;
using System.Runtime.InteropServices;
using System.Security.Authentication;
using System.Security.Cryptography.X509Certificates;
using System.Threading;
using System.Threading.Tasks;

namespace ClothStream.Core
{
    sealed class StreamSocket : IDisposable
    {
        // Longest message of a server.
        const int MaxMessageBytes = 256 << 20;
        const int FirstBufferBytes = 64 << 10;

        readonly TcpClient tcp;
        readonly string fingerprint;
        readonly CancellationTokenSource cancel = new CancellationTokenSource();
        readonly Action<Task> wake;
        readonly Task<WebSocket> opening;
        WebSocket socket;
        Task<WebSocketReceiveResult> receiving;
        Task sending;
        byte[] incoming = new byte[FirstBufferBytes], outgoing = new byte[1024];
        int received;
        bool closing;

        /// <param name="fingerprint">Of the server's key; "" means that an authority of the system must have signed the
        /// certificate.</param>
        public StreamSocket(ServerAddress address, string fingerprint, AutoResetEvent woken)
        {
            this.fingerprint = fingerprint;
            wake = task => woken.Set();
            tcp = new TcpClient { NoDelay = true };
            opening = Open(address);
            Watch(opening);
        }

        public bool IsOpen { get; private set; }
        public bool HasEnded { get; private set; }
        /// <summary>Whether the connection could not be opened. Poll then says why.</summary>
        public bool HasFailed { get { return opening.IsFaulted || opening.IsCanceled; } }
        /// <summary>Why the connection has ended; "" if the server closed it without a reason.</summary>
        public string Why { get; private set; } = "";
        /// <summary>With TLS, what the server has shown.</summary>
        public string ShownFingerprint { get; private set; } = "";
        public bool IsTrusted { get; private set; } = true;
        public bool CanSend { get { return IsOpen && sending == null && !closing; } }

        /// <summary>Takes the results of tasks. Returns the bytes of a message that has arrived, else 0.</summary>
        public int Poll()
        {
            if (HasEnded) return 0;
            try
            {
                if (!IsOpen)
                {
                    if (!opening.IsCompleted) return 0;
                    socket = opening.GetAwaiter().GetResult();
                    IsOpen = true;
                    Receive();
                }
                if (sending != null && sending.IsCompleted)
                {
                    sending.GetAwaiter().GetResult();
                    sending = null;
                }
                return TakeReceived();
            }
            catch (Exception error)
            {
                End(Innermost(error));
                return 0;
            }
        }

        /// <summary>The message that Poll returned. Valid until the next Poll.</summary>
        public byte[] Message { get { return incoming; } }

        public unsafe void Send(byte* message, int bytes)
        {
            if (outgoing.Length < bytes) outgoing = new byte[bytes];
            Marshal.Copy((IntPtr)message, outgoing, 0, bytes);
            Start(() => socket.SendAsync(new ArraySegment<byte>(outgoing, 0, bytes), WebSocketMessageType.Binary, true, cancel.Token));
        }

        /// <summary>Says goodbye. The connection has ended when the server has answered.</summary>
        public void Close()
        {
            if (!CanSend) return;
            closing = true;
            Start(() => socket.CloseOutputAsync(WebSocketCloseStatus.NormalClosure, "", cancel.Token));
        }

        public void Dispose()
        {
            HasEnded = true;
            IsOpen = false;
            cancel.Cancel();
            socket?.Dispose();
            tcp.Dispose();
        }

        async Task<WebSocket> Open(ServerAddress address)
        {
            await tcp.ConnectAsync(address.Host, address.Port).ConfigureAwait(false);
            Stream stream = tcp.GetStream();
            if (address.IsEncrypted)
            {
                var encrypted = new SslStream(stream, false, IsExpected);
                await encrypted.AuthenticateAsClientAsync(address.Host, null, SslProtocols.None, false).ConfigureAwait(false);
                stream = encrypted;
            }
            return await WebSocketUpgrade.Open(stream, address.Stream).ConfigureAwait(false);
        }

        bool IsExpected(object sender, X509Certificate certificate, X509Chain chain, SslPolicyErrors errors)
        {
            ShownFingerprint = certificate == null ? "" : KeyFingerprint.Of(certificate.GetRawCertData());
            IsTrusted = fingerprint == "" ? errors == SslPolicyErrors.None : ShownFingerprint == fingerprint;
            return IsTrusted;
        }

        int TakeReceived()
        {
            if (receiving == null) Receive();
            if (!receiving.IsCompleted) return 0;
            WebSocketReceiveResult result = receiving.GetAwaiter().GetResult();
            receiving = null;
            received += result.Count;
            if (result.MessageType == WebSocketMessageType.Close)
            {
                End(result.CloseStatusDescription ?? "");
                return 0;
            }
            if (result.EndOfMessage)
            {
                int bytes = received;
                received = 0;
                return result.MessageType == WebSocketMessageType.Binary ? bytes : 0;
            }
            if (received == incoming.Length)
            {
                if (incoming.Length >= MaxMessageBytes) throw new InvalidOperationException("the server sends a message of more than 256 MiB");
                Array.Resize(ref incoming, 2 * incoming.Length);
            }
            Receive();
            return 0;
        }

        void Receive()
        {
            receiving = socket.ReceiveAsync(new ArraySegment<byte>(incoming, received, incoming.Length - received), cancel.Token);
            Watch(receiving);
        }

        void Start(Func<Task> begin)
        {
            try
            {
                sending = begin();
                Watch(sending);
            }
            catch (Exception error)
            {
                End(Innermost(error));
            }
        }

        void Watch(Task task)
        {
            task.ContinueWith(wake, TaskContinuationOptions.ExecuteSynchronously);
        }

        void End(string why)
        {
            Why = why;
            Dispose();
        }

        static string Innermost(Exception error)
        {
            while (error.InnerException != null) error = error.InnerException;
            return error.Message;
        }
    }
}
