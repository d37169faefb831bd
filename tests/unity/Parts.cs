// SPDX-License-Identifier: MIT
// Checks of what needs no server: addresses, fingerprints and options.
using System;
using ClothStream.Core;

static class Parts
{
    static void Is(string text, string stream, bool isLoopback)
    {
        var address = new ServerAddress(text);
        if (address.Stream.ToString() != stream || address.IsLoopback != isLoopback)
            throw new Exception("not so: " + text + " is " + address.Stream + ", loopback " + address.IsLoopback);
    }

    static void IsRefused(string what, Action action, string reason)
    {
        try { action(); }
        catch (ArgumentException error)
        {
            if (!error.Message.Contains(reason)) throw new Exception("not so: " + what + " is refused with " + reason + ", but: " + error.Message);
            return;
        }
        throw new Exception("not so: " + what + " is refused");
    }

    static void IsNoAddress(string text, string reason)
    {
        IsRefused("the address \"" + text + "\"", () => new ServerAddress(text), reason);
    }

    static void IsNoOption(ClientOptions options, string reason)
    {
        IsRefused("the option", () => new Client(options).Dispose(), reason);
    }

    public static void Run()
    {
        Is("host", "ws://host:8080/stream", false);
        Is("localhost:81", "ws://localhost:81/stream", true);
        Is("ws://127.0.0.1", "ws://127.0.0.1:8080/stream", true);
        Is("https://cloth.example.org:444/", "wss://cloth.example.org:444/stream", false);
        Is("wss://[2001:db8::1]:9", "wss://[2001:db8::1]:9/stream", false);
        Is("::1", "ws://[::1]:8080/stream", true);
        IsNoAddress("", "no host");
        IsNoAddress("host:0", "no valid port");
        IsNoAddress("host:65536", "no valid port");
        IsNoAddress("host:", "no valid port");
        IsNoAddress("ftp://host", "has no");
        IsNoAddress("a b", "no host");

        string digits = new string('a', 62) + "0f";
        string normal = KeyFingerprint.Normal(digits);
        if (normal.Length != 95 || !normal.EndsWith("AA:0F") || KeyFingerprint.Normal(normal) != normal)
            throw new Exception("not so: a fingerprint has pairs of digits");
        IsRefused("a short fingerprint", () => KeyFingerprint.Normal("AA:BB"), "64 hexadecimal digits");
        IsRefused("a fingerprint with other letters", () => KeyFingerprint.Normal(new string('g', 64)), "64 hexadecimal digits");
        RefusesMalformedCertificates();

        IsNoOption(new ClientOptions { Address = "example.org", Token = "secret" }, "wss://example.org");
        IsNoOption(new ClientOptions { Address = "example.org", PairingCode = "123456" }, "only with TLS");
        IsNoOption(new ClientOptions { Fingerprint = digits }, "needs TLS");
        IsNoOption(new ClientOptions { Scene = "a\0b" }, "zero character");
    }

    // No prefix of a certificate is read beyond its end.
    static void RefusesMalformedCertificates()
    {
        byte[] sequence = { 0x30, 0x10, 0x30, 0x0e, 0xa0, 0x00, 0x02, 0x00, 0x30, 0x00, 0x30, 0x00, 0x30, 0x00, 0x30, 0x00, 0x30, 0x00 };
        if (KeyFingerprint.Of(sequence) == "") throw new Exception("not so: a certificate with empty fields has a fingerprint");
        for (int bytes = 0; bytes < sequence.Length; ++bytes)
        {
            var prefix = new byte[bytes];
            Array.Copy(sequence, prefix, bytes);
            if (KeyFingerprint.Of(prefix) != "") throw new Exception("not so: a certificate that ends after " + bytes + " bytes is malformed");
        }
        if (KeyFingerprint.Of(new byte[] { 0x30, 0x84, 0xff, 0xff, 0xff, 0xff }) != "") throw new Exception("not so: a length of 4 GiB is refused");
    }
}
