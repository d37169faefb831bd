// SPDX-License-Identifier: MIT
// Writes JSON: objects, lists of numbers, and texts.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace ClothStream.Export
{
    /// <summary>Text of one JSON object. Members are added in order, and nested objects are complete when they are added.</summary>
    public sealed class JsonText
    {
        readonly StringBuilder text = new StringBuilder("{");

        public JsonText Add(string name, string value) { return AddRaw(name, Quoted(value)); }
        public JsonText Add(string name, double value) { return AddRaw(name, Number(value)); }
        public JsonText Add(string name, JsonText value) { return AddRaw(name, value.ToString()); }
        public JsonText Add(string name, IEnumerable<double> values) { return AddRaw(name, Listed(values, Number)); }
        public JsonText Add(string name, IEnumerable<int> values) { return AddRaw(name, Listed(values, value => value.ToString(CultureInfo.InvariantCulture))); }
        public JsonText Add(string name, IEnumerable<JsonText> values) { return AddRaw(name, Listed(values, value => value.ToString())); }

        public JsonText AddFlag(string name) { return AddRaw(name, "true"); }

        public override string ToString() { return text + "}"; }

        JsonText AddRaw(string name, string value)
        {
            if (text.Length > 1) text.Append(',');
            text.Append(Quoted(name)).Append(':').Append(value);
            return this;
        }

        // Six places after the point: a micrometre.
        static string Number(double value)
        {
            string written = value.ToString("0.######", CultureInfo.InvariantCulture);
            return written == "-0" ? "0" : written;
        }

        static string Listed<T>(IEnumerable<T> values, Func<T, string> write)
        {
            var list = new StringBuilder("[");
            foreach (T value in values)
            {
                if (list.Length > 1) list.Append(',');
                list.Append(write(value));
            }
            return list.Append(']').ToString();
        }

        static string Quoted(string value)
        {
            var quoted = new StringBuilder("\"");
            foreach (char letter in value)
            {
                if (letter == '"' || letter == '\\') quoted.Append('\\').Append(letter);
                else if (letter < ' ') quoted.Append("\\u").Append(((int)letter).ToString("x4", CultureInfo.InvariantCulture));
                else quoted.Append(letter);
            }
            return quoted.Append('"').ToString();
        }
    }
}
