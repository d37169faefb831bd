// SPDX-License-Identifier: MIT
// Mesh with weights in the frame of the figure: checked, mirrored and in metres.
using System;
using System.Collections.Generic;
using System.Linq;

namespace ClothStream.Export
{
    sealed class SkinnedMesh
    {
        readonly SkinnedMeshSource source;
        readonly Point[] points;

        public readonly int[] Triangles; // counter-clockwise seen from the front
        public readonly int[] PlaceOf;   // for each vertex, the number of its place; vertices in one place are one node
        public readonly int PlaceCount;

        /// <summary>`toFigure`: from the frame of the mesh.</summary>
        public SkinnedMesh(SkinnedMeshSource source, Affine toFigure)
        {
            this.source = source;
            points = Enumerable.Range(0, source.VertexCount).Select(vertex => toFigure.Apply(UnityPoint(source.Positions, vertex))).ToArray();
            Triangles = source.Triangles.ToArray();
            // The mirror image of a triangle has its front on the other side.
            for (int i = 0; i < Triangles.Length; i += 3) Array.Reverse(Triangles, i + 1, 2);
            PlaceOf = Places(source, out PlaceCount);
        }

        public string Name { get { return source.Name; } }
        public int VertexCount { get { return points.Length; } }
        public Point this[int vertex] { get { return points[vertex]; } }

        /// <summary>Throws unless the mesh has triangles, bones and weights that belong together.</summary>
        public static void Check(SkinnedMeshSource mesh)
        {
            int vertices = mesh.VertexCount;
            if (vertices == 0 || mesh.Triangles.Length == 0) throw new ExportException(mesh.Name + ": the mesh has no triangles.");
            if (mesh.VertexWeights.Length != 4 * vertices || mesh.VertexBones.Length != 4 * vertices)
                throw new ExportException(mesh.Name + ": the mesh has no weights for its bones. Bind it to a skeleton in a modelling tool.");
            if (mesh.BindPoses.Length != mesh.Bones.Length)
                throw new ExportException(mesh.Name + ": the renderer has " + mesh.Bones.Length + " bones, but the mesh has " + mesh.BindPoses.Length + " bind poses. Use the mesh that belongs to the skeleton.");
            for (int i = 0; i < mesh.Positions.Length; ++i)
                if (float.IsNaN(mesh.Positions[i]) || float.IsInfinity(mesh.Positions[i])) throw new ExportException(mesh.Name + ": vertex " + i / 3 + " has a position that is not a number.");
            for (int vertex = 0; vertex < vertices; ++vertex)
            {
                float sum = 0;
                for (int i = 4 * vertex; i < 4 * vertex + 4; ++i)
                {
                    if (mesh.VertexWeights[i] > 0 && (mesh.VertexBones[i] < 0 || mesh.VertexBones[i] >= mesh.Bones.Length))
                        throw new ExportException(mesh.Name + ": vertex " + vertex + " has bone " + mesh.VertexBones[i] + "; the renderer has bones 0 to " + (mesh.Bones.Length - 1) + ".");
                    sum += Math.Max(0, mesh.VertexWeights[i]);
                }
                if (!(sum > 0)) throw new ExportException(mesh.Name + ": vertex " + vertex + " has no weight. Give each vertex at least one bone.");
            }
        }

        /// <summary>Mesh message with positions, triangles and texture coordinates.</summary>
        public JsonText Message(bool withUvs)
        {
            JsonText message = new JsonText().Add("positions", points.SelectMany(point => new[] { point.X, point.Y, point.Z })).Add("triangles", Triangles);
            if (withUvs && source.Uvs != null && source.Uvs.Length == 2 * VertexCount) message.Add("uvs", source.Uvs.Select(value => (double)value));
            return message;
        }

        /// <summary>Adds the joints and weights of all vertices. Weights of a vertex add up to 1.</summary>
        public void AddWeights(JsonText message, Joints joints)
        {
            var indices = new int[4 * VertexCount];
            var weights = new double[4 * VertexCount];
            for (int i = 0; i < indices.Length; ++i)
            {
                if (!(source.VertexWeights[i] > 0)) continue;
                double sum = 0;
                for (int other = i / 4 * 4; other < i / 4 * 4 + 4; ++other) sum += Math.Max(0, source.VertexWeights[other]);
                indices[i] = joints.JointOf(source, source.VertexBones[i]);
                weights[i] = source.VertexWeights[i] / sum;
            }
            message.Add("vertexJoints", indices).Add("vertexWeights", weights);
        }

        /// <summary>Area of all triangles, m^2.</summary>
        public double Area
        {
            get
            {
                double area = 0;
                for (int i = 0; i < Triangles.Length; i += 3)
                    area += Point.Cross(points[Triangles[i + 1]] - points[Triangles[i]], points[Triangles[i + 2]] - points[Triangles[i]]).Length / 2;
                return area;
            }
        }

        /// <summary>Lengths of the edges of all triangles between different places, metres; at least one.</summary>
        public IEnumerable<double> Edges
        {
            get
            {
                for (int i = 0; i < Triangles.Length; ++i)
                {
                    int next = i % 3 == 2 ? i - 2 : i + 1;
                    if (PlaceOf[Triangles[i]] != PlaceOf[Triangles[next]]) yield return (points[Triangles[i]] - points[Triangles[next]]).Length;
                }
            }
        }

        /// <summary>Number of edges that do not have exactly two triangles with opposite directions.</summary>
        public int OpenEdges
        {
            get
            {
                var uses = new Dictionary<long, int>(); // of each directed edge
                for (int i = 0; i < Triangles.Length; ++i)
                {
                    int from = PlaceOf[Triangles[i]], to = PlaceOf[Triangles[i % 3 == 2 ? i - 2 : i + 1]];
                    int before;
                    uses.TryGetValue(((long)from << 32) | (uint)to, out before);
                    uses[((long)from << 32) | (uint)to] = before + 1;
                }
                int open = 0;
                foreach (KeyValuePair<long, int> edge in uses)
                {
                    int back;
                    uses.TryGetValue((edge.Key << 32) | (edge.Key >> 32), out back);
                    if (edge.Value != 1 || back != 1) ++open;
                }
                return open;
            }
        }

        static Point UnityPoint(float[] positions, int vertex)
        {
            return Point.OfUnity(positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]);
        }

        // Numbers the places of vertices in the order in which they first occur.
        static int[] Places(SkinnedMeshSource mesh, out int count)
        {
            var numbers = new Dictionary<(float, float, float), int>();
            var places = new int[mesh.VertexCount];
            for (int vertex = 0; vertex < places.Length; ++vertex)
            {
                var place = (mesh.Positions[3 * vertex], mesh.Positions[3 * vertex + 1], mesh.Positions[3 * vertex + 2]);
                if (!numbers.TryGetValue(place, out places[vertex])) numbers[place] = places[vertex] = numbers.Count;
            }
            count = numbers.Count;
            return places;
        }
    }
}
