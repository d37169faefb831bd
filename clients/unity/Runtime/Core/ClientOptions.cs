// SPDX-License-Identifier: MIT
namespace ClothStream.Core
{
    /// <summary>How a client joins. Strings may be null, which counts as "".</summary>
    public sealed class ClientOptions
    {
        /// <summary>See <see cref="ServerAddress"/>.</summary>
        public string Address = "127.0.0.1:8080";
        /// <summary>"" means the server's default scene.</summary>
        public string Scene = "";
        /// <summary>Name of the program.</summary>
        public string ClientName = "ClothStream for Unity";
        /// <summary>Name that other participants see.</summary>
        public string DisplayName = "";
        public Role Role = Role.Unspecified;
        /// <summary>Proof for a server that requires one: a token, or a pairing code of six digits. They are sent to other
        /// machines only with TLS.</summary>
        public string Token = "", PairingCode = "";
        /// <summary>With TLS: the server must have the key with this fingerprint, 64 hexadecimal digits. "" means that an
        /// authority of the system must have signed its certificate.</summary>
        public string Fingerprint = "";
        /// <summary>Text of Client.ResumeToken, by which a restarted program returns as the same participant.</summary>
        public string ResumeToken = "";
        /// <summary>Best quality level, 0 (finest) to 3.</summary>
        public uint Quality;
    }
}
