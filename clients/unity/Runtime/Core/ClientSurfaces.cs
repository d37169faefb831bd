// SPDX-License-Identifier: MIT
// Surfaces of the real room of this participant, which cloth does not pass through.
using System;

namespace ClothStream.Core
{
    public sealed unsafe partial class Client
    {
        /// <summary>What the server does with surfaces; Unknown before this client has joined.</summary>
        public SurfacePolicy SurfacePolicy
        {
            get { lock (Gate) return Native.cs_get_surface_policy(Handle); }
        }

        /// <summary>Says how far the policy of the server may go for surfaces to be sent: Own (default) or Everyone. Ask the
        /// user first.</summary>
        public void AllowSurfaces(SurfacePolicy policy)
        {
            lock (Gate) Native.cs_allow_surfaces(Handle, (uint)policy);
            Flush();
        }

        /// <summary>Adds a surface, or replaces the one with its id. The mesh is copied, sent in parts, and sent again after a
        /// reconnect. Returns false if the server takes no surfaces, if its policy goes further than AllowSurfaces says, or if
        /// there are no or too many triangles. The event Error reports a refusal by the server.</summary>
        /// <param name="positions">x, y, z of each vertex, m, -100 to 100, in the frame of the surface.</param>
        /// <param name="triangles">Three vertices of each triangle, counter-clockwise seen from the front in the right-handed
        /// coordinates of the stream.</param>
        /// <param name="position">3 numbers.</param>
        /// <param name="orientation">Quaternion x y z w.</param>
        /// <param name="twoSided">Cloth can be on both sides. Otherwise it passes the surface from behind.</param>
        /// <param name="friction">0 to 10, multiplied with the cloth's.</param>
        public bool SetSurface(uint id, float[] positions, uint[] triangles, float[] position, float[] orientation, bool twoSided, float friction)
        {
            bool isSet;
            fixed (float* vertices = positions)
            fixed (uint* corners = triangles)
            {
                var surface = new Surface
                {
                    version = Native.CS_SURFACE_VERSION, id = id, positions = vertices, vertexCount = (uint)positions.Length / 3, triangles = corners,
                    triangleCount = (uint)triangles.Length / 3, twoSided = twoSided ? 1u : 0u, friction = friction
                };
                for (int i = 0; i < 3; ++i) surface.position[i] = position[i];
                for (int i = 0; i < 4; ++i) surface.orientation[i] = orientation[i];
                lock (Gate) isSet = Native.cs_set_surface(Handle, &surface) != 0;
            }
            Flush();
            return isSet;
        }

        /// <summary>Moves a surface, which stands in its new pose from the next tick on. Returns false if there is none with
        /// this id.</summary>
        public bool MoveSurface(uint id, float[] position, float[] orientation)
        {
            bool isKnown;
            fixed (float* at = position, turned = orientation)
                lock (Gate) isKnown = Native.cs_move_surface(Handle, id, at, turned) != 0;
            Flush();
            return isKnown;
        }

        /// <summary>Removes a surface. Returns false if there is none with this id.</summary>
        public bool RemoveSurface(uint id)
        {
            bool isKnown;
            lock (Gate) isKnown = Native.cs_remove_surface(Handle, id) != 0;
            Flush();
            return isKnown;
        }
    }
}
