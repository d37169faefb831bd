// SPDX-License-Identifier: MIT
// Bodies of the scene that participants wear.
using System.Collections.Generic;

namespace ClothStream.Core
{
    public sealed unsafe partial class Client
    {
        /// <summary>Index among the colliders and name of each body of the scene that can be worn.</summary>
        public KeyValuePair<int, string>[] Bodies
        {
            get
            {
                lock (Gate)
                {
                    var bodies = new List<KeyValuePair<int, string>>();
                    var collider = new Collider { version = Native.CS_COLLIDER_VERSION };
                    for (uint i = 0; Native.cs_get_collider(Handle, i, &collider) != 0; ++i)
                        if (Native.cs_is_body(Handle, i) != 0) bodies.Add(new KeyValuePair<int, string>((int)i, Utf8.Text(collider.name)));
                    return bodies.ToArray();
                }
            }
        }

        /// <summary>Takes a body of the scene, or gives the own one back. Events.Presence or Events.Error follows.</summary>
        /// <param name="body">Name of the collider; null or "" gives back.</param>
        /// <returns>False if the scene has no such body.</returns>
        public bool Wear(string body)
        {
            bool isTaken;
            fixed (byte* name = Utf8.Bytes(body))
                lock (Gate) isTaken = Native.cs_wear(Handle, name) != 0;
            Flush();
            return isTaken;
        }

        /// <summary>Name of the collider that a participant wears; "" for none.</summary>
        public string BodyOf(ulong participant)
        {
            lock (Gate) return Utf8.Text(Native.cs_body_of(Handle, participant));
        }

        /// <summary>Bends the own body to this person, and sends it. Call it once for each displayed frame.</summary>
        /// <param name="tracked">Its version need not be set.</param>
        /// <returns>False without a body or a tracked head.</returns>
        public bool SetBody(TrackedBody tracked, ulong timeUs)
        {
            tracked.version = Native.CS_TRACKED_BODY_VERSION;
            bool follows;
            lock (Gate) follows = Native.cs_set_body(Handle, &tracked, timeUs) != 0;
            Flush();
            return follows;
        }

        /// <summary>Collider of the scene as it is shown: where Play has put it if play-out is on, else as in the newest
        /// frame.</summary>
        public bool TryGetShownCollider(int index, out Collider collider)
        {
            lock (Gate)
            {
                var found = new Collider { version = Native.CS_COLLIDER_VERSION };
                bool isFound = playsOut && Native.cs_get_played_collider(Handle, (uint)index, &found) != 0;
                if (!isFound) isFound = Native.cs_get_collider(Handle, (uint)index, &found) != 0;
                collider = found;
                return isFound;
            }
        }
    }
}
