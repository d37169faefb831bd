// SPDX-License-Identifier: MIT
// The colliders of a figure: the mesh that has its joints, and the capsules and spheres of Unity's Cloth.
using System;
using System.Collections.Generic;
using System.Linq;

namespace ClothStream.Export
{
    static class FigureColliders
    {
        // Limits of ClothStream (proto/clothstream/v1/scene.proto).
        const int MostColliders = 64, MostVertices = 60000, MostTriangles = 20000;
        const double LeastRadius = 0.001, MostTaper = 0.99;
        const double CarrierSize = 0.002; // metres, of a tetrahedron
        const double LengthTolerance = 0.05;

        /// <summary>Name of the collider with the joints.</summary>
        public const string Figure = "figure";

        public static List<JsonText> All(FigureSource figure, Joints joints, ExportedScene scene)
        {
            var skin = new JsonText().Add("joints", joints.Messages());
            JsonText mesh = figure.Body == null ? Carrier(joints, skin) : Body(figure.Body, joints, skin);
            if (figure.Frames.Count > 0) skin.Add("animation", new JsonText().Add("keys", joints.Keys(scene)));
            var colliders = new List<JsonText> { new JsonText().Add("name", Figure).Add("mesh", mesh.Add("skin", skin)) };
            foreach (CapsuleSource capsule in figure.Capsules) colliders.Add(Between(Ends(figure, capsule), figure, joints, scene, Named(capsule.Name, colliders.Count)));
            foreach (SpherePairSource pair in figure.SpherePairs)
                if (pair.First != null || pair.Second != null) colliders.Add(Between(Ends(figure, pair), figure, joints, scene, Named((pair.First ?? pair.Second).Name, colliders.Count)));
            if (colliders.Count > MostColliders)
                throw new ExportException(figure.Name + ": the Cloth has " + (colliders.Count - 1) + " capsules and spheres; at most " + (MostColliders - 1) + " are possible. Remove some.");
            if (colliders.Count > 1)
                scene.Notes.Add("Capsules and spheres follow the exported animation. They do not follow joints that a participant moves; a body does.");
            return colliders;
        }

        static JsonText Body(SkinnedMeshSource source, Joints joints, JsonText skin)
        {
            var mesh = new SkinnedMesh(source, joints.BodyToFigure);
            if (mesh.VertexCount > MostVertices || mesh.Triangles.Length / 3 > MostTriangles)
                throw new ExportException(mesh.Name + ": the body has " + mesh.VertexCount + " vertices and " + mesh.Triangles.Length / 3 + " triangles; at most " + MostVertices + " and " + MostTriangles + " are possible. Use a coarser mesh.");
            int open = mesh.OpenEdges;
            if (open > 0)
                throw new ExportException(mesh.Name + ": the body is not closed: " + open + " edges do not have exactly two triangles. Close it in a modelling tool, for example with the limits of eyes and mouth, or choose no body.");
            mesh.AddWeights(skin, joints);
            return mesh.Message(false);
        }

        // A small tetrahedron at each joint, inside the body that Unity draws. Cloth can follow only the joints of a mesh.
        static JsonText Carrier(Joints joints, JsonText skin)
        {
            var corners = new[] { new Point(1, 1, 1), new Point(1, -1, -1), new Point(-1, 1, -1), new Point(-1, -1, 1) };
            int[] faces = { 0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2 };
            var positions = new List<double>();
            var triangles = new List<int>();
            var vertexJoints = new List<int>();
            var weights = new List<double>();
            for (int joint = 0; joint < joints.Count; ++joint)
            {
                triangles.AddRange(faces.Select(corner => 4 * joint + corner));
                foreach (Point corner in corners)
                {
                    Point place = joints.Rest(joint).Apply(corner * (CarrierSize / 2));
                    positions.AddRange(new[] { place.X, place.Y, place.Z });
                    vertexJoints.AddRange(new[] { joint, 0, 0, 0 });
                    weights.AddRange(new double[] { 1, 0, 0, 0 });
                }
            }
            skin.Add("vertexJoints", vertexJoints).Add("vertexWeights", weights);
            return new JsonText().Add("positions", positions).Add("triangles", triangles);
        }

        // A ball that is fixed to a node.
        sealed class Ball
        {
            public int Node;
            public Point Center; // in the frame of the node
            public double Radius; // metres
        }

        static Affine MatrixOf(FigureSource figure, int node) { return Affine.OfUnity(figure.Nodes[node].Matrix); }

        // As in Unity, the scale along the axis counts for the height, and the larger other one for the radius.
        static Ball[] Ends(FigureSource figure, CapsuleSource capsule)
        {
            Point scale = MatrixOf(figure, capsule.Node).Scale;
            double[] scales = { scale.X, scale.Y, scale.Z };
            double along = scales[capsule.Direction];
            double radius = capsule.Radius * Math.Max(scales[(capsule.Direction + 1) % 3], scales[(capsule.Direction + 2) % 3]);
            double half = Math.Max(0, capsule.Height / 2 - radius / along);
            var axis = new[] { 0f, 0, 0 };
            axis[capsule.Direction] = 1;
            Point center = Point.OfUnity(capsule.Center[0], capsule.Center[1], capsule.Center[2]), direction = Point.OfUnity(axis[0], axis[1], axis[2]);
            return new[] { center - direction * half, center + direction * half }.Select(end => new Ball { Node = capsule.Node, Center = end, Radius = radius }).ToArray();
        }

        static Ball[] Ends(FigureSource figure, SpherePairSource pair)
        {
            return new[] { pair.First, pair.Second }.Where(sphere => sphere != null).Select(sphere =>
            {
                Point scale = MatrixOf(figure, sphere.Node).Scale;
                return new Ball
                {
                    Node = sphere.Node,
                    Center = Point.OfUnity(sphere.Center[0], sphere.Center[1], sphere.Center[2]),
                    Radius = sphere.Radius * Math.Max(scale.X, Math.Max(scale.Y, scale.Z))
                };
            }).ToArray();
        }

        // The convex hull of one or two balls, with its motion. The first ball is at the lower end of a capsule.
        static JsonText Between(Ball[] balls, FigureSource figure, Joints joints, ExportedScene scene, string name)
        {
            Point[] atRest = balls.Select(ball => joints.AtRest(ball.Node, MatrixOf(figure, ball.Node).Apply(ball.Center))).ToArray();
            double length = balls.Length == 2 ? (atRest[1] - atRest[0]).Length : 0;
            var message = new JsonText().Add("name", name);
            double[] radii = balls.Select(ball => Math.Max(LeastRadius, ball.Radius)).ToArray();
            bool isCapsule = balls.Length == 2 && length > 0 && Math.Abs(radii[1] - radii[0]) <= MostTaper * length;
            int larger = balls.Length == 2 && radii[1] > radii[0] ? 1 : 0; // the one that contains the other if it is no capsule
            if (isCapsule)
            {
                var capsule = new JsonText().Add("radius", radii[0]).Add("length", length);
                message.Add("capsule", radii[1] == radii[0] ? capsule : capsule.Add("topRadius", radii[1]));
            }
            else
            {
                message.Add("sphere", new JsonText().Add("radius", radii[larger]));
            }
            Func<Point[], RigidPose> pose = places => isCapsule ? RigidPose.AlongY((places[0] + places[1]) * 0.5, places[1] - places[0]) : new RigidPose(places[larger], 0, 0, 0, 1);
            message.Add("pose", Poses.Message(pose(atRest)));
            if (figure.Frames.Count == 0) return message;

            bool changes = false;
            var keys = new List<JsonText>();
            foreach (FrameSource frame in figure.Frames)
            {
                Point[] places = balls.Select(ball => Affine.OfUnity(frame.Matrices[ball.Node]).Apply(ball.Center)).ToArray();
                if (isCapsule && Math.Abs((places[1] - places[0]).Length / length - 1) > LengthTolerance) changes = true;
                keys.Add(Poses.Key(frame.Time, pose(places)));
            }
            if (changes) scene.Notes.Add("The spheres of " + name + " move towards each other by more than 5 %. The capsule between them keeps its length.");
            return message.Add("motion", new JsonText().Add("keys", keys).AddFlag("steady"));
        }

        static string Named(string name, int number)
        {
            string allowed = Names.Allowed(name);
            return allowed.Substring(0, Math.Min(allowed.Length, 56)) + "_" + number;
        }
    }

    static class Names
    {
        /// <summary>Name for ClothStream: 1 to 64 characters out of [a-z0-9_-].</summary>
        public static string Allowed(string name)
        {
            string allowed = new string(name.ToLowerInvariant().Select(letter => letter >= 'a' && letter <= 'z' || letter >= '0' && letter <= '9' || letter == '-' ? letter : '_').ToArray()).Trim('_');
            return allowed == "" ? "unnamed" : allowed.Substring(0, Math.Min(64, allowed.Length));
        }
    }
}
