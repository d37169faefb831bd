// SPDX-License-Identifier: MIT
// Poses, grabs and attachments of this participant.
using System;

namespace ClothStream.Core
{
    public sealed unsafe partial class Client
    {
        /// <summary>Replaces the colliders of this participant: at most 40, or 20 with two hands. Their version need not be
        /// set.</summary>
        public void SetShapes(OwnCollider[] colliders, int count, ulong timeUs)
        {
            count = Math.Min(count, (int)Native.CS_MAX_COLLIDERS);
            OwnCollider* first = stackalloc OwnCollider[count];
            for (int i = 0; i < count; ++i)
            {
                first[i] = colliders[i];
                first[i].version = Native.CS_OWN_COLLIDER_VERSION;
            }
            lock (Gate) Native.cs_set_colliders(Handle, first, (uint)count, timeUs);
            Flush();
        }

        /// <summary>Replaces one tracked hand; an empty array removes it.</summary>
        /// <param name="joints">{x, y, z, radius} for each of 26 joints, in the order of OpenXR: palm first.</param>
        /// <exception cref="ArgumentException">The number of joints is neither 0 nor 26.</exception>
        public void SetHand(HandSide side, float[] joints, ulong timeUs)
        {
            fixed (float* first = joints)
                lock (Gate)
                    if (Native.cs_set_hand(Handle, (uint)side, first, (uint)joints.Length / 4, timeUs) == 0)
                        throw new ArgumentException("A hand has 26 joints of 4 numbers, not " + joints.Length + " numbers.");
            Flush();
        }

        /// <summary>Replaces the head, by which others recognise this participant. It looks along -Z of its own frame.</summary>
        /// <param name="position">3 numbers; null removes the head.</param>
        /// <param name="orientation">Quaternion x y z w; null means unknown.</param>
        public void SetHead(float[] position, float[] orientation, float radius, ulong timeUs)
        {
            fixed (float* at = position, turned = orientation)
                lock (Gate) Native.cs_set_head(Handle, at, turned, radius, timeUs);
            Flush();
        }

        /// <summary>Replaces the grabs of this participant, at most 10. A new id takes hold; an id that is missing lets
        /// go. Version and place of a grab need not be set.</summary>
        /// <param name="places">Place of each grab; null: the grabs take what is near them on the server.</param>
        public void SetGrabs(Grab[] grabs, ClothPoint[] places, int count, ulong timeUs)
        {
            count = Math.Min(count, (int)Native.CS_MAX_GRABS);
            Grab* first = stackalloc Grab[count];
            fixed (ClothPoint* firstPlace = places)
            {
                for (int i = 0; i < count; ++i)
                {
                    first[i] = grabs[i];
                    first[i].version = Native.CS_GRAB_VERSION;
                    first[i].place = firstPlace == null ? null : firstPlace + i;
                }
                lock (Gate) Native.cs_set_grabs(Handle, first, (uint)count, timeUs);
            }
            Flush();
        }

        /// <summary>Finds the point of a shown cloth that is nearest to a point, within a distance (m).</summary>
        public bool TryFindNearest(float x, float y, float z, float maxDistance, out ClothPoint point)
        {
            float* from = stackalloc float[3];
            from[0] = x;
            from[1] = y;
            from[2] = z;
            var found = new ClothPoint { version = Native.CS_CLOTH_POINT_VERSION };
            lock (Gate)
            {
                bool succeeds = Native.cs_nearest_point(Handle, from, maxDistance, &found) != 0;
                point = succeeds ? found : new ClothPoint();
                return succeeds;
            }
        }

        /// <summary>Moves an attachment of the scene; it stays there.</summary>
        /// <param name="orientation">Quaternion x y z w; null means no rotation.</param>
        /// <param name="jumps">Whether its cloth goes along at once, however short the way is, as at a teleport.</param>
        public void MoveAttachment(string attachment, float[] position, float[] orientation, bool jumps, ulong timeUs)
        {
            fixed (byte* name = Utf8.Bytes(attachment))
            fixed (float* at = position, turned = orientation)
                lock (Gate) Native.cs_move_attachment(Handle, name, at, turned, jumps ? 1 : 0, timeUs);
            Flush();
        }

        /// <summary>Moves the joints of a collider of the scene that is a mesh with joints; they stay there.</summary>
        /// <param name="poses">Seven numbers for each joint: position and quaternion x y z w, relative to its parent.</param>
        /// <param name="jumps">Whether they are there in one tick, as at a teleport; the cloth that follows them goes
        /// along.</param>
        public void MoveJoints(string collider, float[] poses, bool jumps, ulong timeUs)
        {
            fixed (byte* name = Utf8.Bytes(collider))
            fixed (float* first = poses)
                lock (Gate) Native.cs_move_joints(Handle, name, first, (uint)(poses.Length / 7), jumps ? 1 : 0, timeUs);
            Flush();
        }
    }
}
