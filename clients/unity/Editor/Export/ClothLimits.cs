// SPDX-License-Identifier: MIT
// Coefficients of Unity's Cloth as limits of single vertices.
using System;
using System.Collections.Generic;
using System.Linq;

namespace ClothStream.Export
{
    /// <summary>
    /// Unity's Cloth has one coefficient for each place of the mesh that has vertices, so their number may be less than that
    /// of the vertices. Places are taken in the order in which they first occur.
    /// </summary>
    static class ClothLimits
    {
        // Largest distance of ClothStream, metres. Unity's value for "no limit" is float.MaxValue.
        const float Most = 1000;
        const double BackstopEdges = 10;
        // Allowed difference of a distance between two vertices of the cloth from that in the mesh, as a fraction.
        const double OrderTolerance = 0.05;

        /// <summary>Adds maxDistances, backstopDistances and backstopRadii to a ClothSkin, where there are limits.</summary>
        public static void Add(JsonText skin, SkinnedMesh mesh, ClothSource cloth, ExportOptions options, ExportedScene scene)
        {
            int[] coefficientOf = CoefficientOfVertices(mesh, cloth);
            CheckOrder(mesh, cloth, coefficientOf, scene);
            double[] distances = coefficientOf.Select(i => Limit(cloth.MaxDistances[i])).ToArray();
            if (distances.Any(distance => distance >= 0)) skin.Add("maxDistances", distances);
            double[] backstops = coefficientOf.Select(i => Limit(cloth.CollisionSphereDistances[i])).ToArray();
            if (backstops.All(distance => distance < 0)) return;
            double radius = options.BackstopRadius > 0 ? options.BackstopRadius : BackstopEdges * mesh.Edges.Average();
            radius = Math.Min(radius, Most);
            skin.Add("backstopDistances", backstops).Add("backstopRadii", backstops.Select(distance => distance < 0 ? -1 : radius));
            scene.Notes.Add("Unity does not say how large its collision spheres are. The backstops have a radius of " + Math.Round(radius, 3).ToString(System.Globalization.CultureInfo.InvariantCulture) + " m.");
        }

        // -1: unbounded.
        static double Limit(float distance) { return distance >= Most || float.IsNaN(distance) ? -1 : Math.Max(0, distance); }

        static int[] CoefficientOfVertices(SkinnedMesh mesh, ClothSource cloth)
        {
            int count = cloth.MaxDistances.Length;
            if (count == mesh.VertexCount) return Enumerable.Range(0, count).ToArray();
            if (count == mesh.PlaceCount) return mesh.PlaceOf;
            throw new ExportException(mesh.Name + ": the Cloth has " + count + " coefficients, but the mesh has " + mesh.VertexCount + " vertices in " + mesh.PlaceCount + " places. Remove the Cloth component and add it again, because the mesh has changed.");
        }

        // Compares distances between successive vertices, which do not depend on the frame that Cloth.vertices has. Their
        // ratio to those of the mesh is the scale.
        static void CheckOrder(SkinnedMesh mesh, ClothSource cloth, int[] coefficientOf, ExportedScene scene)
        {
            int count = cloth.MaxDistances.Length;
            if (count == mesh.VertexCount || cloth.Vertices.Length != 3 * count) return;
            var vertexOf = new int[count];
            for (int vertex = mesh.VertexCount - 1; vertex >= 0; --vertex) vertexOf[coefficientOf[vertex]] = vertex;
            var ratios = new List<double>();
            for (int i = 0; i + 1 < count; ++i)
            {
                double own = (mesh[vertexOf[i + 1]] - mesh[vertexOf[i]]).Length;
                double x = cloth.Vertices[3 * i + 3] - cloth.Vertices[3 * i], y = cloth.Vertices[3 * i + 4] - cloth.Vertices[3 * i + 1], z = cloth.Vertices[3 * i + 5] - cloth.Vertices[3 * i + 2];
                ratios.Add(Math.Sqrt(x * x + y * y + z * z) / own);
            }
            if (ratios.Count == 0) return;
            ratios.Sort();
            double median = ratios[ratios.Count / 2];
            int differing = ratios.Count(ratio => Math.Abs(ratio / median - 1) > OrderTolerance);
            // A pose other than that of the binding changes some distances.
            if (differing > ratios.Count / 4) scene.Notes.Add("The order of the vertices of the Cloth could not be confirmed. Look at the limits in the scene, and export in the pose in which the mesh was bound.");
        }
    }
}
