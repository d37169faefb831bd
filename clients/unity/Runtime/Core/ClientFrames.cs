// SPDX-License-Identifier: MIT
// What the scene contains, its newest frame, and play-out.
using System;

namespace ClothStream.Core
{
    /// <summary>A cloth of the scene.</summary>
    public sealed class ClothRange
    {
        public string Name;
        /// <summary>Range in the positions.</summary>
        public int FirstVertex, VertexCount;
        /// <summary>0 if the cloth is not a grid.</summary>
        public int Rows, Columns;
        /// <summary>Range in the triangles.</summary>
        public int FirstIndex, IndexCount;
    }

    public sealed unsafe partial class Client
    {
        bool playsOut;

        /// <summary>Frames per second of the stream; 0 before the description.</summary>
        public int StreamRate { get { lock (Gate) return (int)Native.cs_stream_rate(Handle); } }
        /// <summary>Vertices of all cloths; 0 before the description.</summary>
        public int VertexCount { get { lock (Gate) return (int)Native.cs_vertex_count(Handle); } }
        /// <summary>Hash of the newest decoded frame, for comparison with the server's; 0 before the first.</summary>
        public ulong Hash { get { lock (Gate) return Native.cs_reconstruction_hash(Handle); } }

        /// <summary>Positions of the newest frame, 3 floats per vertex. Hold Gate.</summary>
        public float* Positions { get { return Native.cs_positions(Handle); } }
        /// <summary>Unit normals of the newest frame, 3 floats per vertex. Hold Gate.</summary>
        public float* Normals { get { return Native.cs_normals(Handle); } }
        /// <summary>Positions and unit normals to draw: those that Play chose if play-out is on, else of the newest frame. Hold
        /// Gate.</summary>
        public float* ShownPositions { get { return playsOut ? Native.cs_played_positions(Handle) : Positions; } }
        public float* ShownNormals { get { return playsOut ? Native.cs_played_normals(Handle) : Normals; } }

        /// <summary>Vertex indices of all cloths, 3 per triangle, counter-clockwise seen from the front. Valid until the next
        /// Events.Description. Hold Gate.</summary>
        public uint* Triangles(out int indexCount)
        {
            uint count;
            uint* triangles = Native.cs_triangles(Handle, &count);
            indexCount = (int)count;
            return triangles;
        }

        public ClothRange[] Cloths
        {
            get
            {
                lock (Gate)
                {
                    var cloths = new ClothRange[Native.cs_cloth_count(Handle)];
                    for (uint i = 0; i < cloths.Length; ++i)
                    {
                        var cloth = new Cloth { version = Native.CS_CLOTH_VERSION };
                        Native.cs_get_cloth(Handle, i, &cloth);
                        cloths[i] = new ClothRange
                        {
                            Name = Utf8.Text(cloth.name), FirstVertex = (int)cloth.firstVertex, VertexCount = (int)cloth.vertexCount,
                            Rows = (int)cloth.rows, Columns = (int)cloth.columns, FirstIndex = (int)cloth.firstIndex, IndexCount = (int)cloth.indexCount
                        };
                    }
                    return cloths;
                }
            }
        }

        /// <summary>Writes {u, v} for each vertex of a cloth, v upwards: u grows along the columns of a grid, v falls along its
        /// rows. A vertex of a mesh that lies on a seam gets one of its pairs; without texture coordinates all are 0.</summary>
        /// <param name="uvs">2 floats for each vertex of the cloth.</param>
        public void TextureCoordinates(int cloth, float* uvs)
        {
            lock (Gate)
            {
                var range = new Cloth { version = Native.CS_CLOTH_VERSION };
                if (Native.cs_get_cloth(Handle, (uint)cloth, &range) == 0) throw new ArgumentOutOfRangeException("cloth");
                for (uint i = 0; i < 2 * range.vertexCount; ++i) uvs[i] = 0;
                uint pairs, corners, indices;
                float* values = Native.cs_uvs(Handle, (uint)cloth, &pairs);
                uint* places = Native.cs_uv_indices(Handle, (uint)cloth, &corners);
                uint* triangles = Native.cs_triangles(Handle, &indices);
                for (uint i = 0; i < corners; ++i)
                {
                    uint vertex = triangles[range.firstIndex + i] - range.firstVertex;
                    uvs[2 * vertex] = values[2 * places[i]];
                    uvs[2 * vertex + 1] = values[2 * places[i] + 1];
                }
                if (values != null || range.rows < 2 || range.columns < 2) return;
                for (uint i = 0; i < range.vertexCount; ++i)
                {
                    uvs[2 * i] = i % range.columns / (float)(range.columns - 1);
                    uvs[2 * i + 1] = 1 - i / range.columns / (float)(range.rows - 1);
                }
            }
        }

        /// <summary>Fails if the index is out of range, or before the first report.</summary>
        public bool TryGetReport(int cloth, out ClothReport report)
        {
            lock (Gate)
            {
                var found = new ClothReport { version = Native.CS_CLOTH_REPORT_VERSION };
                bool succeeds = Native.cs_get_cloth_report(Handle, (uint)cloth, &found) != 0;
                report = found;
                return succeeds;
            }
        }

        /// <summary>Turns ConstraintEnds on or off. Default: off.</summary>
        public void WantConstraints(bool wants)
        {
            lock (Gate) Native.cs_want_constraints(Handle, wants ? 1 : 0, NowUs);
            Flush();
        }

        /// <summary>
        /// Active constraints of a cloth with ACAD in the newest report: two vertices for each, numbered from the
        /// cloth's first vertex. At most 16,384 constraints. Empty without WantConstraints.
        /// </summary>
        public uint[] ConstraintEnds(int cloth)
        {
            lock (Gate)
            {
                uint count;
                uint* found = Native.cs_constraint_ends(Handle, (uint)cloth, &count);
                var ends = new uint[2 * count];
                for (int i = 0; i < ends.Length; ++i) ends[i] = found[i];
                return ends;
            }
        }

        public Statistics Statistics
        {
            get
            {
                lock (Gate)
                {
                    var statistics = new Statistics { version = Native.CS_STATISTICS_VERSION };
                    Native.cs_get_statistics(Handle, NowUs, &statistics);
                    return statistics;
                }
            }
        }

        /// <summary>Turns play-out on.</summary>
        /// <param name="delayMs">Delay from a tick on the server to its display, 0 to 10000. NaN means adaptive.</param>
        public void StartPlayOut(double delayMs = double.NaN)
        {
            lock (Gate)
            {
                PlayOutOptions options;
                Native.cs_default_play_out(&options);
                options.delayMs = delayMs;
                if (Native.cs_set_play_out(Handle, &options) == 0)
                    throw new ArgumentOutOfRangeException("delayMs", delayMs, "Use 0 to 10000 ms, or NaN for an adaptive delay.");
                playsOut = true;
            }
        }

        public void StopPlayOut()
        {
            lock (Gate)
            {
                Native.cs_set_play_out(Handle, null);
                playsOut = false;
            }
        }

        /// <summary>Chooses what ShownPositions are, for a display at displayTimeUs. Does nothing while play-out is off.</summary>
        public Played Play(ulong displayTimeUs)
        {
            lock (Gate)
            {
                var played = new Played { version = Native.CS_PLAYED_VERSION };
                if (playsOut) Native.cs_play_out(Handle, NowUs, displayTimeUs, &played);
                return played;
            }
        }

        /// <summary>Keeps the shown cloth out of the own hand while the server's answer is under way. Needs play-out.</summary>
        public void SetLocalContact(bool on)
        {
            lock (Gate) Native.cs_set_local_contact(Handle, on ? 1 : 0);
        }

        /// <summary>Length of the largest correction by the last Play, m.</summary>
        public float LocalCorrection { get { lock (Gate) return Native.cs_local_correction(Handle); } }
    }
}
