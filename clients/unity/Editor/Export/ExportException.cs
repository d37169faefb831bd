// SPDX-License-Identifier: MIT
// Reason why an object of Unity cannot become a scene.
using System;

namespace ClothStream.Export
{
    /// <summary>Says what is wrong, where, and what to do. The text is for people.</summary>
    public sealed class ExportException : Exception
    {
        public ExportException(string message) : base(message) { }
    }
}
