// SPDX-License-Identifier: MIT
// Fingerprint of a server's key: SHA-256 of the SubjectPublicKeyInfo in its certificate (RFC 5280), as a server with
// --tls self prints it.
using System;
using System.Security.Cryptography;
using System.Text;

namespace ClothStream.Core
{
    public static class KeyFingerprint
    {
        const int Digits = 64;
        const byte Sequence = 0x30, Version = 0xa0;

        /// <summary>Returns the 64 hexadecimal digits of a fingerprint in pairs with colons.</summary>
        /// <exception cref="ArgumentException">The text is not a fingerprint.</exception>
        public static string Normal(string text)
        {
            var digits = new StringBuilder();
            foreach (char letter in text)
            {
                if (letter == ':' || letter == ' ') continue;
                if (!Uri.IsHexDigit(letter)) digits.Append(' ', Digits);
                digits.Append(char.ToUpperInvariant(letter));
            }
            if (digits.Length != Digits)
                throw new ArgumentException("\"" + text + "\" is not a fingerprint; use 64 hexadecimal digits, with or without colons.");
            for (int i = Digits - 2; i > 0; i -= 2) digits.Insert(i, ':');
            return digits.ToString();
        }

        /// <summary>Returns the fingerprint of the key in a certificate (DER); "" if it is malformed.</summary>
        public static string Of(byte[] certificate)
        {
            int at = 0, end = certificate.Length;
            // Certificate and TBSCertificate: sequences, whose first elements follow.
            if (!Enter(certificate, ref at, ref end) || !Enter(certificate, ref at, ref end)) return "";
            if (at < end && certificate[at] == Version && !Skip(certificate, ref at, end)) return "";
            // serialNumber, signature, issuer, validity, subject
            for (int i = 0; i < 5; ++i)
                if (!Skip(certificate, ref at, end)) return "";
            int begin = at;
            if (!Skip(certificate, ref at, end)) return "";
            using (SHA256 sha = SHA256.Create())
                return Normal(BitConverter.ToString(sha.ComputeHash(certificate, begin, at - begin)).Replace("-", ""));
        }

        // Reads the tag and length of an element. contents: where it begins. Returns false if it does not fit.
        static bool Read(byte[] der, int at, int end, out int contents, out int length)
        {
            contents = length = 0;
            if (end - at < 2) return false;
            int lengthBytes = 0;
            length = der[at + 1];
            contents = at + 2;
            if (length >= 0x80)
            {
                lengthBytes = length & 0x7f;
                if (lengthBytes < 1 || lengthBytes > 3 || end - contents < lengthBytes) return false;
                length = 0;
                for (int i = 0; i < lengthBytes; ++i) length = length << 8 | der[contents++];
            }
            return length <= end - contents;
        }

        static bool Enter(byte[] der, ref int at, ref int end)
        {
            int contents, length;
            if (!Read(der, at, end, out contents, out length) || der[at] != Sequence) return false;
            at = contents;
            end = contents + length;
            return true;
        }

        static bool Skip(byte[] der, ref int at, int end)
        {
            int contents, length;
            if (!Read(der, at, end, out contents, out length)) return false;
            at = contents + length;
            return true;
        }
    }
}
