// SPDX-License-Identifier: MIT
// Parameters and the clock of the scene. Events.Parameters follows when a change took effect.

namespace ClothStream.Core
{
    public sealed unsafe partial class Client
    {
        /// <summary>Fails before the description.</summary>
        public bool TryGetEnvironment(out Environment environment)
        {
            lock (Gate)
            {
                var found = new Environment { version = Native.CS_ENVIRONMENT_VERSION };
                bool succeeds = Native.cs_get_environment(Handle, &found) != 0;
                environment = found;
                return succeeds;
            }
        }

        /// <summary>Changes gravity (m/s^2), wind (m/s) and air density (kg/m^3). null keeps a value.</summary>
        public void SetEnvironment(float[] gravity, float[] wind, float? airDensity)
        {
            float density = airDensity.GetValueOrDefault();
            fixed (float* first = gravity, second = wind)
                lock (Gate) Native.cs_set_environment(Handle, first, second, airDensity.HasValue ? &density : null);
            Flush();
        }

        /// <summary>Fails if the index is out of range.</summary>
        public bool TryGetClothSettings(int cloth, out ClothSettings settings)
        {
            lock (Gate)
            {
                var found = new ClothSettings { version = Native.CS_CLOTH_SETTINGS_VERSION };
                bool succeeds = Native.cs_get_cloth_settings(Handle, (uint)cloth, &found) != 0;
                settings = found;
                return succeeds;
            }
        }

        /// <summary>Returns settings that change nothing, as the start of a change.</summary>
        public static ClothSettings KeepClothSettings()
        {
            ClothSettings settings;
            Native.cs_keep_cloth_settings(&settings);
            return settings;
        }

        /// <summary>Changes the settings of a cloth; "" means every cloth. Fails before the description and for an unknown
        /// cloth.</summary>
        public bool ChangeCloth(string cloth, ClothSettings settings)
        {
            bool succeeds;
            fixed (byte* name = Utf8.Bytes(cloth))
                lock (Gate) succeeds = Native.cs_set_cloth(Handle, name, &settings) != 0;
            Flush();
            return succeeds;
        }

        /// <summary>Applies a material of the server to a cloth.</summary>
        public void SetMaterial(string cloth, string material)
        {
            fixed (byte* name = Utf8.Bytes(cloth), applied = Utf8.Bytes(material))
                lock (Gate) Native.cs_set_material(Handle, name, applied);
            Flush();
        }

        /// <summary>Stops or restarts the clock of the scene, for all participants.</summary>
        public void Pause(bool paused)
        {
            lock (Gate) Native.cs_pause(Handle, paused ? 1 : 0);
            Flush();
        }

        /// <summary>Puts all cloths back to their start. Returns the id of the request; 0 if it cannot be sent.</summary>
        public ulong Reset()
        {
            ulong request;
            fixed (byte* joined = Utf8.Bytes(""))
                lock (Gate) request = Native.cs_reset_scene(Handle, joined);
            Flush();
            return request;
        }
    }
}
