// SPDX-License-Identifier: MIT
// The bones that move a cloth and a body, as the joints of a collider: their order, their rest poses and their animation.
using System;
using System.Collections.Generic;
using System.Linq;

namespace ClothStream.Export
{
    /// <summary>
    /// Joints rest where the meshes were bound, because linear blend skinning is exact only from there. The place of the
    /// figure is that of its topmost joint at present.
    /// </summary>
    sealed class Joints
    {
        // Limits of ClothStream (proto/clothstream/v1/scene.proto).
        public const int MostJoints = 128, MostKeys = 1024, MostPoses = 16384;
        // Largest distance between the places that cloth and body give the origin of a bone, metres.
        const double BindTolerance = 0.005;
        const double ScaleTolerance = 0.01;

        readonly FigureSource figure;
        readonly List<int> nodes = new List<int>(); // of each joint, parents first
        readonly Dictionary<int, int> jointOfNode = new Dictionary<int, int>();
        readonly Dictionary<int, Affine> bound = new Dictionary<int, Affine>(); // map of a bone's node when the meshes were bound
        readonly RigidPose[] rest; // of each joint in the frame of the figure

        /// <summary>Maps from the frame of a mesh to that of the figure, when it was bound. Of the body only if there is one.</summary>
        public Affine ClothToFigure { get; private set; }
        public Affine BodyToFigure { get; private set; }

        public Joints(FigureSource figure)
        {
            this.figure = figure;
            SkinnedMeshSource first = figure.Body ?? figure.ClothMesh;
            int[] used = UsedBones(first).OrderBy(bone => Depth(first.Bones[bone])).ToArray();
            Affine place = Current(first.Bones[used[0]]) * Affine.OfUnity(first.BindPoses[used[0]]);
            CheckPlace(first, place);
            foreach (int bone in used) bound[first.Bones[bone]] = place * Invert(first, bone);
            BodyToFigure = ClothToFigure = place;
            if (figure.Body != null) BindCloth();

            nodes.AddRange(bound.Keys.OrderBy(Depth).ThenBy(node => node));
            if (nodes.Count > MostJoints)
                throw new ExportException(figure.Name + ": " + nodes.Count + " bones move the meshes; at most " + MostJoints + " are possible. Remove small bones, such as those of fingers and the face, from the weights.");
            for (int joint = 0; joint < nodes.Count; ++joint) jointOfNode[nodes[joint]] = joint;
            rest = nodes.Select(node => Rigid(bound[node], node)).ToArray();
        }

        public int Count { get { return nodes.Count; } }
        public RigidPose Rest(int joint) { return rest[joint]; }

        /// <summary>Joint of a bone of a mesh that has a weight.</summary>
        public int JointOf(SkinnedMeshSource mesh, int bone) { return jointOfNode[mesh.Bones[bone]]; }

        /// <summary>Where a point that is fixed to a node is while the joints rest. `now`: its place at present.</summary>
        public Point AtRest(int node, Point now)
        {
            int above = JointAbove(node, true);
            return above < 0 ? now : (rest[above] * Now(nodes[above]).Inverse).Apply(now);
        }

        /// <summary>The joints as messages.</summary>
        public IEnumerable<JsonText> Messages()
        {
            for (int joint = 0; joint < Count; ++joint)
            {
                int parent = JointAbove(nodes[joint], false);
                RigidPose pose = parent < 0 ? rest[joint] : rest[parent].Inverse * rest[joint];
                var message = new JsonText().Add("name", OneLine(figure.Nodes[nodes[joint]].Name));
                if (parent >= 0) message.Add("parent", parent);
                yield return message.Add("rest", Poses.Message(pose));
            }
        }

        /// <summary>The keys of the animation as messages; none without an animation.</summary>
        public IEnumerable<JsonText> Keys(ExportedScene scene)
        {
            int most = Math.Min(MostKeys, MostPoses / Count);
            if (figure.Frames.Count == 1 || figure.Frames.Count > most)
                throw new ExportException(figure.Name + ": the animation has " + figure.Frames.Count + " frames; 2 to " + most + " are possible for " + Count + " joints. Choose a lower rate or a shorter clip.");
            var scaled = new SortedSet<string>(StringComparer.Ordinal);
            var messages = new List<JsonText>();
            foreach (FrameSource frame in figure.Frames)
            {
                RigidPose[] poses = nodes.Select(node => Rigid(Affine.OfUnity(frame.Matrices[node]), node)).ToArray();
                foreach (int node in nodes)
                    if (Math.Abs(Affine.OfUnity(frame.Matrices[node]).UniformScale / bound[node].UniformScale - 1) > ScaleTolerance) scaled.Add(figure.Nodes[node].Name);
                var local = new JsonText[Count];
                for (int joint = 0; joint < Count; ++joint)
                {
                    int parent = JointAbove(nodes[joint], false);
                    local[joint] = Poses.Message(parent < 0 ? poses[joint] : poses[parent].Inverse * poses[joint]);
                }
                messages.Add(new JsonText().Add("time", frame.Time).Add("joints", local));
            }
            if (scaled.Count > 0) scene.Notes.Add("The animation changes the scale of " + string.Join(", ", scaled.Take(5)) + (scaled.Count > 5 ? " and others" : "") + ". Joints of ClothStream keep their scale.");
            return messages;
        }

        // Bones of a mesh that have a weight.
        static IEnumerable<int> UsedBones(SkinnedMeshSource mesh)
        {
            return Enumerable.Range(0, mesh.VertexWeights.Length).Where(i => mesh.VertexWeights[i] > 0).Select(i => mesh.VertexBones[i]).Distinct();
        }

        // Binds the cloth to the bones of the body, and to its own further bones.
        void BindCloth()
        {
            SkinnedMeshSource mesh = figure.ClothMesh;
            int[] used = UsedBones(mesh).OrderBy(bone => Depth(mesh.Bones[bone])).ToArray();
            int[] shared = used.Where(bone => bound.ContainsKey(mesh.Bones[bone])).ToArray();
            if (shared.Length == 0)
                throw new ExportException(mesh.Name + " and " + figure.Body.Name + " have no bone in common. Choose the body that belongs to the cloth, or none.");
            ClothToFigure = bound[mesh.Bones[shared[0]]] * Affine.OfUnity(mesh.BindPoses[shared[0]]);
            CheckPlace(mesh, ClothToFigure);
            foreach (int bone in used)
            {
                Affine own = ClothToFigure * Invert(mesh, bone);
                if (!bound.ContainsKey(mesh.Bones[bone]))
                {
                    bound[mesh.Bones[bone]] = own;
                    continue;
                }
                double away = (own.Apply(new Point()) - bound[mesh.Bones[bone]].Apply(new Point())).Length;
                if (away > BindTolerance)
                    throw new ExportException(mesh.Name + " and " + figure.Body.Name + " were bound in different poses: " + figure.Nodes[mesh.Bones[bone]].Name + " is " + Math.Round(1000 * away) + " mm away. Bind both in the same pose of the skeleton.");
            }
        }

        static void CheckPlace(SkinnedMeshSource mesh, Affine place)
        {
            if (place.UniformScale == 0)
                throw new ExportException(mesh.Name + ": the mesh is mirrored, sheared or scaled differently along its axes. Give its transforms the same positive scale along all axes.");
        }

        Affine Invert(SkinnedMeshSource mesh, int bone)
        {
            Affine bindPose = Affine.OfUnity(mesh.BindPoses[bone]);
            if (Math.Abs(bindPose.Determinant) < 1e-30)
                throw new ExportException(mesh.Name + ": the bind pose of " + figure.Nodes[mesh.Bones[bone]].Name + " has no inverse. Export the mesh again from its modelling tool.");
            return bindPose.Inverse;
        }

        Affine Current(int node) { return Affine.OfUnity(figure.Nodes[node].Matrix); }
        RigidPose Now(int node) { return Rigid(Current(node), node); }

        RigidPose Rigid(Affine map, int node)
        {
            if (map.UniformScale == 0)
                throw new ExportException(figure.Name + ": " + figure.Nodes[node].Name + " is mirrored, sheared or scaled differently along its axes. Give it and the transforms above it the same positive scale along all axes.");
            return map.Rigid;
        }

        int Depth(int node)
        {
            int depth = 0;
            for (int above = figure.Nodes[node].Parent; above >= 0; above = figure.Nodes[above].Parent) ++depth;
            return depth;
        }

        // The nearest joint above a node, or the node's own; -1 if there is none.
        int JointAbove(int node, bool own)
        {
            for (int above = own ? node : figure.Nodes[node].Parent; above >= 0; above = figure.Nodes[above].Parent)
            {
                int joint;
                if (jointOfNode.TryGetValue(above, out joint)) return joint;
            }
            return -1;
        }

        static string OneLine(string name) { return new string(name.Where(letter => !char.IsControl(letter)).Take(200).ToArray()); }
    }

    static class Poses
    {
        public static JsonText Message(RigidPose pose) { return Write(pose, new JsonText()); }

        /// <summary>A key of a Motion.</summary>
        public static JsonText Key(double time, RigidPose pose) { return Write(pose, new JsonText().Add("time", time)); }

        public static JsonText Vector(Point point) { return new JsonText().Add("x", point.X).Add("y", point.Y).Add("z", point.Z); }

        static JsonText Write(RigidPose pose, JsonText message)
        {
            var turn = new JsonText().Add("x", pose.X).Add("y", pose.Y).Add("z", pose.Z).Add("w", pose.W);
            return message.Add("position", Vector(pose.Position)).Add("orientation", turn);
        }
    }
}
