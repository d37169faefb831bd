// SPDX-License-Identifier: MIT
// A client with a thread that has the connection: it receives, decodes, acknowledges and reconnects.
using System;
using System.Diagnostics;
using System.Linq;
using System.Threading;

namespace ClothStream.Core
{
    /// <summary>
    /// Joins a scene and stays in it until Dispose. A lost connection is opened again, also if the first attempt fails.
    ///
    /// Threads: all members may be used from any thread. The client's thread holds Gate while it decodes a message. Code that
    /// reads memory of the client (positions, for example) holds Gate as long as it reads:
    /// <c>lock (client.Gate) { float* positions = client.Positions; ... }</c>.
    ///
    /// Times are microseconds of NowUs. Coordinates are those of the stream: right-handed, +Y up, metres.
    /// </summary>
    public sealed unsafe partial class Client : IDisposable
    {
        // Longest time between two calls of cs_update, and time for the server to answer a goodbye.
        const int UpdateIntervalMs = 50, ClosingMs = 500;
        const int MaxShownLetters = 300;

        readonly ServerAddress address;
        readonly string fingerprint;
        readonly bool hasCode;
        readonly IntPtr core;
        readonly Thread thread;
        readonly AutoResetEvent woken = new AutoResetEvent(false);
        ServerAddress current; // of the newest connection
        StreamSocket socket;
        StreamSocket prepared; // to preparedAt, for a scene that moves there; null: none
        string preparedAt = "";
        Events events;
        string failure = "", problem = "";
        volatile bool leaving, isDisposed;

        /// <exception cref="ArgumentException">An option is not allowed. The message says which, and what is.</exception>
        public Client(ClientOptions options)
        {
            if (IntPtr.Size != 8) throw new PlatformNotSupportedException("ClothStream needs a 64-bit device; build for ARM64.");
            address = new ServerAddress(options.Address);
            fingerprint = string.IsNullOrEmpty(options.Fingerprint) ? "" : KeyFingerprint.Normal(options.Fingerprint);
            hasCode = !string.IsNullOrEmpty(options.PairingCode);
            bool hasSecret = !string.IsNullOrEmpty(options.Token) || hasCode;
            if (hasSecret && !address.IsEncrypted && !address.IsLoopback)
                throw new ArgumentException("A token or pairing code is sent to another machine only with TLS; use wss://" + address + ".");
            if (fingerprint != "" && !address.IsEncrypted)
                throw new ArgumentException("A fingerprint needs TLS; use wss://" + address + ".");
            fixed (byte* scene = Utf8.Bytes(options.Scene), program = Utf8.Bytes(options.ClientName), name = Utf8.Bytes(options.DisplayName))
            {
                var joining = new NativeClientOptions
                {
                    version = Native.CS_CLIENT_OPTIONS_VERSION, role = (uint)options.Role, scene = scene, clientName = program, displayName = name
                };
                core = Native.cs_create(&joining);
            }
            Native.cs_want(Handle, options.Quality);
            fixed (byte* token = Utf8.Bytes(options.Token), code = Utf8.Bytes(options.PairingCode), resume = Utf8.Bytes(options.ResumeToken))
            {
                if (!string.IsNullOrEmpty(options.Token)) Native.cs_set_token(Handle, token);
                if (!string.IsNullOrEmpty(options.PairingCode)) Native.cs_set_pairing_code(Handle, code);
                Native.cs_set_resume_token(Handle, resume);
            }
            thread = new Thread(Run) { IsBackground = true, Name = "ClothStream" };
            thread.Start();
        }

        /// <summary>Leaves the scene. Takes at most half a second. Do not hold Gate: the client's thread needs it.</summary>
        public void Dispose()
        {
            if (leaving) return;
            leaving = true;
            woken.Set();
            thread.Join();
            lock (Gate)
            {
                isDisposed = true;
                Native.cs_destroy(core);
            }
        }

        /// <summary>Microseconds of a monotonic clock.</summary>
        public static ulong NowUs
        {
            get
            {
                long ticks = Stopwatch.GetTimestamp(), frequency = Stopwatch.Frequency;
                return (ulong)(ticks / frequency * 1000000 + ticks % frequency * 1000000 / frequency);
            }
        }

        /// <summary>Held by the client's thread while it decodes.</summary>
        public object Gate { get; } = new object();
        /// <summary>The cs_client, for functions of <see cref="Native"/> that have no member here. Hold Gate.</summary>
        /// <exception cref="ObjectDisposedException">Dispose was called.</exception>
        public IntPtr Handle
        {
            get
            {
                if (isDisposed) throw new ObjectDisposedException("Client");
                return core;
            }
        }

        public State State { get { lock (Gate) return failure != "" ? State.Failed : Native.cs_get_state(Handle); } }
        /// <summary>The last error as a sentence; "" if there was none.</summary>
        public string ErrorText { get { lock (Gate) return failure != "" ? failure : Utf8.Text(Native.cs_error_text(Handle)); } }
        /// <summary>ErrorCode of session.proto; 0 if the client itself found the error.</summary>
        public uint ErrorCode { get { lock (Gate) return Native.cs_error_code(Handle); } }
        /// <summary>Why there is no connection now; "" if there is one, or before the first attempt has failed.</summary>
        public string Problem { get { lock (Gate) return problem; } }
        public string Notice { get { lock (Gate) return Utf8.Text(Native.cs_notice_text(Handle)); } }
        public string ServerName { get { lock (Gate) return Utf8.Text(Native.cs_server_name(Handle)); } }
        public string DeviceName { get { lock (Gate) return Utf8.Text(Native.cs_device_name(Handle)); } }
        public string SceneName { get { lock (Gate) return Utf8.Text(Native.cs_scene_name(Handle)); } }
        /// <summary>Token in use. After Events.Token, that of pairing: keep it secret.</summary>
        public string Token { get { lock (Gate) return Utf8.Text(Native.cs_token(Handle)); } }
        public string ResumeToken { get { lock (Gate) return Utf8.Text(Native.cs_resume_token(Handle)); } }
        /// <summary>Whether the server still knew this participant when the client came back.</summary>
        public bool Resumed { get { lock (Gate) return Native.cs_resumed(Handle) != 0; } }

        /// <summary>Returns what has changed since the last call.</summary>
        public Events TakeEvents()
        {
            lock (Gate)
            {
                Events taken = events;
                events = 0;
                return taken;
            }
        }

        // Wakes the thread, which sends what waits.
        void Flush()
        {
            woken.Set();
        }

        void Run()
        {
            try
            {
                while (!leaving && !HasFailed)
                {
                    lock (Gate) StartConnection();
                    using (socket = TakePrepared() ?? new StreamSocket(current, fingerprint, woken)) Serve();
                    WaitForNextAttempt();
                }
            }
            catch (Exception error)
            {
                Fail(error.Message);
            }
            prepared?.Dispose();
        }

        void Prepare(ServerAddress next)
        {
            prepared?.Dispose();
            preparedAt = next.ToString();
            prepared = new StreamSocket(next, fingerprint, woken);
        }

        StreamSocket TakePrepared()
        {
            StreamSocket taken = prepared;
            prepared = null;
            if (taken != null && preparedAt == current.ToString() && !taken.HasFailed) return taken;
            taken?.Dispose();
            return null;
        }

        // The scene may be at another server than that of the address. Secrets go to other machines only with TLS.
        void StartConnection()
        {
            current = address.At(Utf8.Text(Native.cs_connect_server(Handle)));
            bool mayFollow = address.IsEncrypted || (!hasCode && Utf8.Text(Native.cs_token(Handle)) == "");
            Native.cs_follow_redirects(Handle, mayFollow ? 1 : 0);
            Native.cs_connecting(Handle, NowUs);
        }

        bool HasFailed { get { return State == State.Failed; } }

        void Serve()
        {
            var closing = new Stopwatch();
            while (!socket.HasEnded)
            {
                int bytes = socket.Poll();
                lock (Gate)
                {
                    if (bytes > 0) Receive(bytes);
                    Native.cs_update(Handle, NowUs);
                    if (socket.CanSend) Send();
                    if (socket.IsOpen) problem = "";
                }
                if (leaving || HasFailed)
                {
                    closing.Start();
                    if (!socket.IsOpen || closing.ElapsedMilliseconds >= ClosingMs) return;
                    socket.Close();
                }
                else if (NowUs >= ConnectAt)
                {
                    lock (Gate) problem = "The server at " + current + " does not answer.";
                    return;
                }
                if (bytes == 0) woken.WaitOne(UpdateIntervalMs);
            }
            Explain();
        }

        ulong ConnectAt { get { lock (Gate) return Native.cs_connect_at(Handle); } }

        void Receive(int bytes)
        {
            fixed (byte* message = socket.Message)
            {
                var news = (Events)Native.cs_receive(Handle, message, (UIntPtr)bytes, NowUs);
                if ((news & Events.Moving) != 0) Prepare(address.At(Utf8.Text(Native.cs_next_server(Handle))));
                events |= news;
                Keep(news);
            }
        }

        void Send()
        {
            UIntPtr bytes;
            byte* message = Native.cs_next_outgoing(Handle, &bytes);
            if (message != null) socket.Send(message, (int)bytes);
        }

        void Explain()
        {
            lock (Gate)
            {
                if (!socket.IsTrusted) Fail(NotTrusted());
                else if (socket.Why == "") problem = "The server at " + current + " has closed the connection.";
                else problem = "No connection to the server at " + current + ": " + Printable(socket.Why).TrimEnd('.') + ".";
            }
        }

        // The server, or a program that answers in its place, may have sent the text.
        static string Printable(string text)
        {
            return string.Concat(text.Where(letter => !char.IsControl(letter)).Take(MaxShownLetters));
        }

        string NotTrusted()
        {
            string text = "The server at " + current + " is not the one expected: ";
            if (fingerprint != "")
                return text + "it has the fingerprint " + socket.ShownFingerprint + ". If this is right, use it; otherwise another server answers.";
            return text + "no known authority has signed its certificate for this name. Use the fingerprint of the server's key. This server shows the fingerprint " +
                   socket.ShownFingerprint + ".";
        }

        void Fail(string text)
        {
            lock (Gate)
            {
                failure = text;
                events |= Events.Error;
            }
        }

        void WaitForNextAttempt()
        {
            lock (Gate) Native.cs_disconnected(Handle, NowUs);
            while (!leaving && !HasFailed)
            {
                ulong now = NowUs, at = ConnectAt;
                if (now >= at) return;
                woken.WaitOne((int)Math.Min((at - now) / 1000 + 1, UpdateIntervalMs));
            }
        }
    }
}
