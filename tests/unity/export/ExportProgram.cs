// SPDX-License-Identifier: MIT
// Test program for the export of cloth, with the stub of the engine. Usage: ExportProgram.exe FOLDER
// Writes scenes of a figure into FOLDER, and expected.json with what Unity shows: places of vertices and ends of colliders in
// the frame of the figure, in coordinates of Unity. Throws, and so returns 1, if a check fails.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Reflection;
using ClothStream.Editor;
using ClothStream.Export;
using UnityEditor;
using UnityEngine;

static class ExportProgram
{
    const int Around = 8;

    static void Check(bool holds, string what)
    {
        if (!holds) throw new Exception("not so: " + what);
    }

    static void IsRefused(string what, Action action, string reason)
    {
        try { action(); }
        catch (ExportException error)
        {
            Check(error.Message.Contains(reason), what + " is refused with \"" + reason + "\", but: " + error.Message);
            return;
        }
        Check(false, what + " is refused");
    }

    // A figure with hips and a leg, a body around them, and a skirt around that. The root is moved, turned and scaled.
    sealed class Dancer
    {
        public readonly GameObject Root = new GameObject("Dancer"), Hips = new GameObject("Hips"), Leg = new GameObject("Leg"), Foot = new GameObject("Foot");
        public readonly SkinnedMeshRenderer Body, Skirt;
        public readonly Cloth Cloth;
        public readonly AnimationClip Clip = new AnimationClip { name = "walk", length = 1 };

        public Dancer()
        {
            Hips.transform.SetParent(Root.transform, false);
            Leg.transform.SetParent(Hips.transform, false);
            Foot.transform.SetParent(Leg.transform, false);
            Hips.transform.localPosition = new Vector3(0.02f, 1, 0.01f);
            Hips.transform.localRotation = Turn(new Vector3(0, 0, 1), 0.3f);
            Leg.transform.localPosition = new Vector3(0, -0.4f, 0.03f);
            Leg.transform.localRotation = Turn(new Vector3(1, 0, 0), -0.2f);
            Foot.transform.localPosition = new Vector3(0, -0.4f, 0);
            // Two maps from a mesh to the figure, as after two imports.
            Body = Add("Body", Tube(0.1f, 0.2f, 1, true), new Vector3());
            Skirt = Add("Skirt 1", Tube(0.15f, 0.3f, 1, false), new Vector3(0.5f, 0, 0));
            // The figure is bound at the origin, and moves afterwards.
            Root.transform.localPosition = new Vector3(3, 0, -1);
            Root.transform.localRotation = Turn(new Vector3(0, 1, 0), 0.7f);
            Root.transform.localScale = new Vector3(1.5f, 1.5f, 1.5f);
            Clip.Motion = (animated, time) =>
            {
                Check(animated == Root, "the clip moves the root");
                Hips.transform.localPosition = new Vector3(0.02f, 1 + 0.1f * time, 0.01f);
                Leg.transform.localRotation = Turn(new Vector3(1, 0.5f, 0), 0.8f * time);
            };
            Cloth = Skirt.gameObject.AddComponent<Cloth>();
            Cloth.coefficients = Enumerable.Range(0, 4 * Around).Select(CoefficientOf).ToArray();
            Cloth.bendingStiffness = 0.25f;
            Cloth.stretchingStiffness = 0.9f;
            Cloth.damping = 0.1f;
            Cloth.externalAcceleration = new Vector3(0, 0, 2);
            Cloth.capsuleColliders = new[] { Capsule(), null };
            Cloth.sphereColliders = new[] { new ClothSphereColliderPair { first = Sphere(Hips, 0.1f), second = Sphere(Leg, 0.06f) }, new ClothSphereColliderPair { first = Sphere(Foot, 0.05f) } };
        }

        // The upper ring hangs on the hips; the lower ones are freer and freer, and the lowest is unbounded.
        static ClothSkinningCoefficient CoefficientOf(int place)
        {
            int ring = place / Around;
            return new ClothSkinningCoefficient { maxDistance = ring == 3 ? 0 : ring == 0 ? float.MaxValue : 0.3f - 0.1f * ring, collisionSphereDistance = ring == 1 ? 0.02f : float.MaxValue };
        }

        CapsuleCollider Capsule()
        {
            var capsule = Leg.AddComponent<CapsuleCollider>();
            capsule.center = new Vector3(0, -0.2f, 0.01f);
            capsule.direction = 2;
            capsule.radius = 0.04f;
            capsule.height = 0.3f;
            return capsule;
        }

        static SphereCollider Sphere(GameObject holder, float radius)
        {
            var sphere = holder.AddComponent<SphereCollider>();
            sphere.radius = radius;
            return sphere;
        }

        SkinnedMeshRenderer Add(string name, Mesh mesh, Vector3 shift)
        {
            var child = new GameObject(name, typeof(SkinnedMeshRenderer));
            child.transform.SetParent(Root.transform, false);
            child.transform.localPosition = shift;
            var renderer = child.GetComponent<SkinnedMeshRenderer>();
            mesh.vertices = mesh.vertices.Select(vertex => vertex - shift).ToArray();
            renderer.sharedMesh = mesh;
            renderer.bones = new[] { Leg.transform, Hips.transform };
            mesh.bindposes = renderer.bones.Select(bone => bone.localToWorldMatrix.inverse * child.transform.localToWorldMatrix).ToArray();
            return renderer;
        }

        // Rings of vertices about the y axis. The last vertex of a ring is where the first one is, with another texture
        // coordinate. A closed tube has caps.
        static Mesh Tube(float radius, float low, float high, bool closed)
        {
            const int Rings = 4;
            var vertices = new List<Vector3>();
            var uvs = new List<Vector2>();
            var weights = new List<BoneWeight>();
            var triangles = new List<int>();
            for (int ring = 0; ring < Rings; ++ring)
                for (int i = 0; i <= Around; ++i)
                {
                    double angle = 2 * Math.PI * (i % Around) / Around;
                    float part = ring / (Rings - 1f);
                    vertices.Add(new Vector3(radius * (float)Math.Cos(angle), low + part * (high - low), radius * (float)Math.Sin(angle)));
                    uvs.Add(new Vector2 { x = i / (float)Around, y = part });
                    weights.Add(new BoneWeight { boneIndex0 = 0, weight0 = 1 - part, boneIndex1 = 1, weight1 = part });
                }
            // Clockwise seen from outside, as Unity has it.
            for (int ring = 0; ring + 1 < Rings; ++ring)
                for (int i = 0; i < Around; ++i)
                {
                    int a = ring * (Around + 1) + i, b = a + 1, c = a + Around + 1, d = c + 1;
                    triangles.AddRange(new[] { a, c, b, b, c, d });
                }
            int top = (Rings - 1) * (Around + 1);
            for (int i = 1; closed && i + 1 < Around; ++i) triangles.AddRange(new[] { 0, i, i + 1, top, top + i + 1, top + i });
            return new Mesh { vertices = vertices.ToArray(), uv = uvs.ToArray(), boneWeights = weights.ToArray(), triangles = triangles.ToArray() };
        }
    }

    static Quaternion Turn(Vector3 axis, float angle)
    {
        axis = axis * (1 / (float)Math.Sqrt(Vector3.Dot(axis, axis)));
        float sine = (float)Math.Sin(angle / 2);
        return new Quaternion(axis.x * sine, axis.y * sine, axis.z * sine, (float)Math.Cos(angle / 2));
    }

    // Where Unity draws the vertices of a mesh, in the world.
    static IEnumerable<Vector3> Drawn(SkinnedMeshRenderer renderer)
    {
        Mesh mesh = renderer.sharedMesh;
        Matrix4x4[] maps = renderer.bones.Zip(mesh.bindposes, (bone, pose) => bone.localToWorldMatrix * pose).ToArray();
        return mesh.vertices.Zip(mesh.boneWeights, (vertex, weight) => maps[weight.boneIndex0].MultiplyPoint3x4(vertex) * weight.weight0 + maps[weight.boneIndex1].MultiplyPoint3x4(vertex) * weight.weight1);
    }

    static string Listed(IEnumerable<Vector3> points, Matrix4x4 toFigure)
    {
        return "[" + string.Join(",", points.Select(world =>
        {
            Vector3 point = toFigure.MultiplyPoint3x4(world);
            return string.Format(CultureInfo.InvariantCulture, "{0:r},{1:r},{2:r}", point.x, point.y, point.z);
        })) + "]";
    }

    // Cloth, body, and the two ends of the capsule and of the pair of spheres, one after the other.
    static string Shown(Dancer dancer)
    {
        Matrix4x4 toFigure = Matrix4x4.TRS(dancer.Root.transform.position, dancer.Root.transform.rotation, new Vector3(1, 1, 1)).inverse;
        Matrix4x4 leg = dancer.Leg.transform.localToWorldMatrix;
        var ends = new[] { leg.MultiplyPoint3x4(new Vector3(0, -0.2f, -0.1f)), leg.MultiplyPoint3x4(new Vector3(0, -0.2f, 0.12f)), dancer.Hips.transform.position, dancer.Leg.transform.position };
        return "{\"cloth\":" + Listed(Drawn(dancer.Skirt), toFigure) + ",\"body\":" + Listed(Drawn(dancer.Body), toFigure) + ",\"ends\":" + Listed(ends, toFigure) + "}";
    }

    static void Set(object of, string field, object value)
    {
        FieldInfo found = of.GetType().GetField(field, BindingFlags.Instance | BindingFlags.NonPublic);
        found.SetValue(of, value);
    }

    static void WritesFileFromWindow(Dancer dancer, string path)
    {
        Selection.activeGameObject = dancer.Skirt.gameObject;
        typeof(ClothExportWindow).GetMethod("Open", BindingFlags.Static | BindingFlags.NonPublic).Invoke(null, null);
        var window = new ClothExportWindow();
        Set(window, "choice", new FigureChoice { cloth = dancer.Skirt, body = dancer.Body, clip = dancer.Clip, framesPerSecond = 4 });
        EditorUtility.SavePath = path;
        GUILayout.Pressed = "Export...";
        typeof(ClothExportWindow).GetMethod("OnGUI", BindingFlags.Instance | BindingFlags.NonPublic).Invoke(window, null);
        Check(EditorGUILayout.Type == MessageType.Info && EditorGUILayout.Message.StartsWith("Written: " + path), "the window says what it has written, not " + EditorGUILayout.Message);
        Check(EditorGUILayout.Message.Contains("radius of"), "and what is otherwise than in Unity");
        Check(!AnimationMode.InAnimationMode(), "the animation mode has ended");
        Set(window, "choice", new FigureChoice());
        typeof(ClothExportWindow).GetMethod("OnGUI", BindingFlags.Instance | BindingFlags.NonPublic).Invoke(window, null);
        Check(EditorGUILayout.Type == MessageType.Error && EditorGUILayout.Message.Contains("No cloth is chosen"), "the window says why it cannot export");
    }

    static ExportedScene Export(FigureChoice choice, ExportOptions options = null)
    {
        return ClothScene.Export(FigureReader.Read(choice), options ?? new ExportOptions());
    }

    static void RefusesReasonsInPlainWords()
    {
        var plain = new GameObject("Plain", typeof(SkinnedMeshRenderer)).GetComponent<SkinnedMeshRenderer>();
        IsRefused("no choice", () => Export(new FigureChoice()), "No cloth is chosen");
        IsRefused("a renderer without Cloth", () => Export(new FigureChoice { cloth = plain }), "Plain has no Cloth component");
        Refuses("a renderer without mesh", dancer => dancer.Skirt.sharedMesh = null, "Skirt 1 has no mesh");
        Refuses("an unreadable mesh", dancer => dancer.Skirt.sharedMesh.isReadable = false, "Switch on Read/Write");
        Refuses("a missing bone", dancer => dancer.Skirt.bones[1] = null, "bone 1 is missing");
        Refuses("a skeleton that Unity has removed", dancer => dancer.Skirt.bones = new Transform[0], "Switch off Optimize Game Objects");
        Refuses("a mesh without weights", dancer => dancer.Skirt.sharedMesh.boneWeights = new BoneWeight[0], "has no weights");
        Refuses("a vertex without weight", dancer => dancer.Skirt.sharedMesh.boneWeights[5] = new BoneWeight(), "vertex 5 has no weight");
        Refuses("a vertex with an unknown bone", dancer => dancer.Skirt.sharedMesh.boneWeights[35].boneIndex1 = 2, "vertex 35 has bone 2; the renderer has bones 0 to 1");
        Refuses("missing bind poses", dancer => dancer.Skirt.sharedMesh.bindposes = new Matrix4x4[1], "2 bones, but the mesh has 1 bind poses");
        Refuses("an empty mesh", dancer => dancer.Skirt.sharedMesh.triangles = new int[0], "has no triangles");
        Refuses("a position that is not a number", dancer => dancer.Skirt.sharedMesh.vertices[7].y = float.NaN, "vertex 7 has a position that is not a number");
        Refuses("other coefficients", dancer => dancer.Cloth.coefficients = new ClothSkinningCoefficient[33], "33 coefficients, but the mesh has 36 vertices in 32 places");
        Refuses("an open body", dancer => dancer.Body.sharedMesh.triangles = dancer.Body.sharedMesh.triangles.Skip(3).ToArray(), "the body is not closed: 3 edges");
        Refuses("a body of other bones", dancer => dancer.Body.bones = new[] { dancer.Foot.transform, dancer.Root.transform }, "no bone in common");
        Refuses("a body that was bound in another pose", dancer => dancer.Body.sharedMesh.bindposes[0] = dancer.Body.sharedMesh.bindposes[0] * Matrix4x4.TRS(new Vector3(0.1f, 0, 0), Quaternion.identity, new Vector3(1, 1, 1)), "were bound in different poses");
        Refuses("a mirrored figure", dancer => dancer.Root.transform.localScale = new Vector3(-1, 1, 1), "the same positive scale");
        Refuses("a scaled bone", dancer => { dancer.Leg.transform.localScale = new Vector3(1, 2, 1); dancer.Skirt.sharedMesh.bindposes[0] = dancer.Leg.transform.localToWorldMatrix.inverse * dancer.Skirt.transform.localToWorldMatrix; dancer.Body.sharedMesh.bindposes[0] = dancer.Leg.transform.localToWorldMatrix.inverse * dancer.Body.transform.localToWorldMatrix; }, "Leg is mirrored, sheared or scaled differently");
        Refuses("no stiffness", dancer => dancer.Cloth.stretchingStiffness = 0, "Stretching Stiffness is 0");
        Refuses("a clip without length", dancer => dancer.Clip.length = 0, "has no length");
        Refuses("a long clip", dancer => dancer.Clip.length = 600, "2401 frames; 2 to 1024 are possible for 2 joints");
        IsRefused("a light cloth", () => Export(new FigureChoice { cloth = new Dancer().Skirt }, new ExportOptions { ArealMass = 0 }), "The mass per area is 0");
        IsRefused("a large backstop", () => Export(new FigureChoice { cloth = new Dancer().Skirt }, new ExportOptions { BackstopRadius = 1001 }), "The backstop radius is 1001 m. Use 0 to 1000.");
        IsRefused("a body that is the cloth", () => { Dancer dancer = new Dancer(); Export(new FigureChoice { cloth = dancer.Skirt, body = dancer.Skirt }); }, "as cloth and as body");
        IsRefused("129 bones", () => Export(new FigureChoice { cloth = ManyBones(129) }), "129 bones move the meshes; at most 128");
        Check(Export(new FigureChoice { cloth = ManyBones(128) }).Json.Contains("bone 127"), "128 bones are possible");
    }

    static void Refuses(string what, Action<Dancer> change, string reason)
    {
        var dancer = new Dancer();
        change(dancer);
        IsRefused(what, () => Export(new FigureChoice { cloth = dancer.Skirt, body = dancer.Body, clip = dancer.Clip, framesPerSecond = 4 }), reason);
        Check(!AnimationMode.InAnimationMode(), "the animation mode has ended after a refusal");
    }

    // A strip of triangles with a bone for each of its vertices, and further bones without weights.
    static SkinnedMeshRenderer ManyBones(int count)
    {
        var strip = new GameObject("Strip", typeof(SkinnedMeshRenderer), typeof(Cloth)).GetComponent<SkinnedMeshRenderer>();
        var bones = Enumerable.Range(0, count + 10).Select(i => new GameObject("bone " + i)).ToArray();
        foreach (GameObject bone in bones) bone.transform.SetParent(strip.transform, false);
        strip.bones = bones.Select(bone => bone.transform).ToArray();
        strip.sharedMesh = new Mesh
        {
            vertices = Enumerable.Range(0, count).Select(i => new Vector3(0.01f * i, 0.02f * (i % 2), 0)).ToArray(),
            triangles = Enumerable.Range(0, 3 * (count - 2)).Select(i => i / 3 + i % 3).ToArray(),
            boneWeights = Enumerable.Range(0, count).Select(i => new BoneWeight { boneIndex0 = i, weight0 = 1 }).ToArray(),
            bindposes = bones.Select(bone => Matrix4x4.identity).ToArray()
        };
        strip.GetComponent<Cloth>().coefficients = new ClothSkinningCoefficient[count];
        return strip;
    }

    static void NotesWhatDiffers()
    {
        var dancer = new Dancer();
        dancer.Cloth.randomAcceleration = new Vector3(1, 0, 0);
        dancer.Cloth.selfCollisionDistance = 1;
        // In play mode, or with another order, vertices of the cloth are elsewhere.
        dancer.Cloth.vertices = Enumerable.Range(0, 4 * Around).Select(i => new Vector3(i * i % 7, 0, 0)).ToArray();
        dancer.Clip.Motion += (root, time) => dancer.Leg.transform.localScale = new Vector3(1, 1, 1) * (1 + time);
        ExportedScene scene = Export(new FigureChoice { cloth = dancer.Skirt, clip = dancer.Clip, framesPerSecond = 4 });
        foreach (string note in new[] { "Random Acceleration", "Self Collision Distance", "World Velocity Scale", "could not be confirmed", "changes the scale of Leg.", "Capsules and spheres follow" })
            Check(scene.Notes.Any(one => one.Contains(note)), "a note says \"" + note + "\"; there are: " + string.Join(" ", scene.Notes));
        var still = new Dancer();
        still.Cloth.vertices = still.Skirt.sharedMesh.vertices.Where((vertex, i) => i % (Around + 1) < Around).Select(vertex => vertex * 2).ToArray();
        Check(!Export(new FigureChoice { cloth = still.Skirt }).Notes.Any(note => note.Contains("confirmed")), "the order is that of the mesh");
    }

    // Expected values from the formulas of clients/unity/README.md, computed by hand.
    static void ConvertsStiffness()
    {
        Check(ClothScene.Stiffness(0, 0.01, 10) == 0 && ClothScene.Stiffness(1, 0.01, 10) == 1e6, "0 is no spring, 1 the stiffest");
        Check(Math.Abs(ClothScene.Stiffness(0.9, 0.01, 10) - 4.5) < 1e-9, "0.9 x 0.01 x 100 / 0.2");
        Check(Math.Abs(ClothScene.DampingRate(0.1, 10) - 1.0536051565782628) < 1e-12 && ClothScene.DampingRate(1, 10) == 1000, "-10 ln 0.9");
    }

    static void Main(string[] arguments)
    {
        ConvertsStiffness();
        RefusesReasonsInPlainWords();
        NotesWhatDiffers();

        string folder = arguments[0];
        WritesFileFromWindow(new Dancer(), Path.Combine(folder, "skirt.json"));
        var dancer = new Dancer();
        var shown = new List<string> { Shown(dancer) };
        for (int step = 0; step <= 4; ++step)
        {
            dancer.Clip.Motion(dancer.Root, step / 4f);
            shown.Add(Shown(dancer));
        }
        File.WriteAllText(Path.Combine(folder, "expected.json"), "[" + string.Join(",", shown) + "]");

        var bare = new Dancer();
        bare.Cloth.useGravity = bare.Cloth.useTethers = false;
        bare.Cloth.externalAcceleration = new Vector3();
        File.WriteAllText(Path.Combine(folder, "bare.json"), Export(new FigureChoice { cloth = bare.Skirt }, new ExportOptions { Material = "cotton" }).Json);
        var flag = new GameObject("Flag", typeof(SkinnedMeshRenderer), typeof(Cloth));
        flag.transform.localPosition = new Vector3(0, 2, 0);
        flag.GetComponent<SkinnedMeshRenderer>().sharedMesh = new Mesh { vertices = new[] { new Vector3(0, 0, 0), new Vector3(0, 1, 0), new Vector3(1, 0, 0) }, triangles = new[] { 0, 1, 2 } };
        flag.GetComponent<Cloth>().coefficients = new[] { new ClothSkinningCoefficient(), new ClothSkinningCoefficient(), new ClothSkinningCoefficient { maxDistance = float.MaxValue, collisionSphereDistance = float.MaxValue } };
        File.WriteAllText(Path.Combine(folder, "flag.json"), Export(new FigureChoice { cloth = flag.GetComponent<SkinnedMeshRenderer>() }).Json);
    }
}
