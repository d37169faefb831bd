// SPDX-License-Identifier: MIT
// Makes a scene of ClothStream from a cloth of Unity: the message Scene of proto/clothstream/v1/scene.proto in JSON.
using System;
using System.Linq;
using System.Text;

namespace ClothStream.Export
{
    public static class ClothScene
    {
        const int MostBytes = 4 * 1024 * 1024; // of a scene file
        const double MostStiffness = 1e6, MostDamping = 1000; // N/m, 1/s
        const double LeastArealMass = 0.0001, MostArealMass = 1000, MostRadius = 1000; // kg/m^2, metres
        const double LeastSelfRadius = 0.00005, Rounding = 1e-6; // metres

        /// <exception cref="ExportException">The figure cannot become a scene.</exception>
        public static ExportedScene Export(FigureSource figure, ExportOptions options)
        {
            if (!(options.ArealMass >= LeastArealMass && options.ArealMass <= MostArealMass)) throw new ExportException("The mass per area is " + options.ArealMass + " kg/m^2. Use 0.0001 to 1000.");
            if (!(options.BackstopRadius >= 0 && options.BackstopRadius <= MostRadius)) throw new ExportException("The backstop radius is " + options.BackstopRadius + " m. Use 0 to 1000.");
            SkinnedMesh.Check(figure.ClothMesh);
            if (figure.Body != null) SkinnedMesh.Check(figure.Body);
            var scene = new ExportedScene();
            var joints = new Joints(figure);
            var mesh = new SkinnedMesh(figure.ClothMesh, joints.ClothToFigure);
            if (!(mesh.Area > 0)) throw new ExportException(mesh.Name + ": all triangles have no area.");

            var skin = new JsonText().Add("collider", FigureColliders.Figure);
            mesh.AddWeights(skin, joints);
            ClothLimits.Add(skin, mesh, figure.Cloth, options, scene);
            var cloth = new JsonText().Add("name", Names.Allowed(mesh.Name)).Add("mesh", mesh.Message(true));
            AddFabric(cloth, mesh, figure.Cloth, options);
            AddSelfCollision(cloth, mesh, figure.Cloth, scene);
            if (figure.Cloth.UseTethers) cloth.Add("tethers", new JsonText());
            cloth.Add("skin", skin);

            float[] gravity = figure.Cloth.Gravity, external = figure.Cloth.ExternalAcceleration;
            Point acceleration = Point.OfUnity(gravity[0], gravity[1], gravity[2]) + Point.OfUnity(external[0], external[1], external[2]);
            string json = new JsonText()
                .Add("name", Names.Allowed(figure.Name))
                .Add("description", "From Unity")
                .Add("environment", new JsonText().Add("gravity", Poses.Vector(acceleration)))
                .Add("cloths", new[] { cloth })
                .Add("colliders", FigureColliders.All(figure, joints, scene))
                .ToString();
            int bytes = Encoding.UTF8.GetByteCount(json);
            if (bytes > MostBytes)
                throw new ExportException(figure.Name + ": the scene has " + Math.Round(bytes / 1048576.0, 1).ToString(System.Globalization.CultureInfo.InvariantCulture) + " MiB; a scene file has at most 4. Use coarser meshes or a lower rate of the animation.");
            NoteDifferences(figure.Cloth, scene);
            scene.Json = json;
            return scene;
        }

        /// <summary>
        /// Stiffness of a spring between two nodes of a mass (kg) that, as a constraint of XPBD over 1 / frequency seconds,
        /// removes the same part of its stretch as Unity: N/m. The part is w / (w + a f^2), with w = 2 / m and the
        /// compliance a = 1 / k.
        /// </summary>
        public static double Stiffness(double part, double mass, double frequency)
        {
            if (!(part > 0)) return 0;
            return part >= 1 ? MostStiffness : Math.Min(MostStiffness, part * mass * frequency * frequency / (2 * (1 - part)));
        }

        /// <summary>Rate of decay that removes a part of the velocity in 1 / frequency seconds: 1/s.</summary>
        public static double DampingRate(double part, double frequency)
        {
            return part >= 1 ? MostDamping : Math.Min(MostDamping, -frequency * Math.Log(1 - Math.Max(0, part)));
        }

        static void AddFabric(JsonText cloth, SkinnedMesh mesh, ClothSource source, ExportOptions options)
        {
            if (options.Material != "")
            {
                cloth.Add("material", options.Material);
                return;
            }
            if (!(source.StretchingStiffness > 0)) throw new ExportException(mesh.Name + ": Stretching Stiffness is " + source.StretchingStiffness + ". Set it above 0, up to 1.");
            double mass = options.ArealMass * mesh.Area / mesh.PlaceCount;
            cloth.Add("arealMass", options.ArealMass).Add("solver", new JsonText().Add("xpbd", new JsonText()));
            cloth.Add("structural", new JsonText().Add("stiffness", Stiffness(source.StretchingStiffness, mass, source.StiffnessFrequency)));
            if (source.BendingStiffness > 0) cloth.Add("bend", new JsonText().Add("stiffness", Stiffness(source.BendingStiffness, mass, source.StiffnessFrequency)));
            cloth.Add("damping", DampingRate(source.Damping, source.StiffnessFrequency)).Add("friction", source.Friction);
        }

        static void AddSelfCollision(JsonText cloth, SkinnedMesh mesh, ClothSource source, ExportedScene scene)
        {
            if (!(source.SelfCollisionDistance > 0)) return;
            double most = mesh.Edges.Min() - 2 * Rounding, radius = Math.Max(LeastSelfRadius, source.SelfCollisionDistance / 2);
            if (radius > most) scene.Notes.Add("Self Collision Distance is more than twice the shortest edge. The balls have that edge as their radius.");
            cloth.Add("selfCollision", new JsonText().Add("radius", Math.Min(radius, most)));
        }

        static void NoteDifferences(ClothSource cloth, ExportedScene scene)
        {
            if (cloth.RandomAcceleration.Any(value => value != 0)) scene.Notes.Add("Random Acceleration is left out. A gust of the scene's environment moves cloth that has drag.");
            if (cloth.WorldVelocityScale < 1 || cloth.WorldAccelerationScale < 1)
                scene.Notes.Add("World Velocity Scale and World Acceleration Scale below 1 are left out: the cloth feels the whole motion of the figure.");
        }
    }
}
