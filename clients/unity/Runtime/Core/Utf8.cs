// SPDX-License-Identifier: MIT
// Strings between C# and the client core.
using System;
using System.Text;

namespace ClothStream.Core
{
    public static unsafe class Utf8
    {
        /// <summary>Returns the text as UTF-8 with a zero at its end. null counts as "".</summary>
        /// <exception cref="ArgumentException">The text contains a zero.</exception>
        public static byte[] Bytes(string text)
        {
            text = text ?? "";
            if (text.IndexOf('\0') >= 0) throw new ArgumentException("A text for the server contains a zero character. Remove it.");
            var bytes = new byte[Encoding.UTF8.GetByteCount(text) + 1];
            Encoding.UTF8.GetBytes(text, 0, text.Length, bytes, 0);
            return bytes;
        }

        /// <summary>Returns a text of the client core. null gives "".</summary>
        public static string Text(byte* bytes)
        {
            if (bytes == null) return "";
            int count = 0;
            while (bytes[count] != 0) ++count;
            return count == 0 ? "" : Encoding.UTF8.GetString(bytes, count);
        }
    }
}
