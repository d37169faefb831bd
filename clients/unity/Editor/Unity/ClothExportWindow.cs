// SPDX-License-Identifier: MIT
// Window that writes a cloth of Unity as a scene file of ClothStream.
using System.IO;
using ClothStream.Export;
using UnityEditor;
using UnityEngine;

namespace ClothStream.Editor
{
    public sealed class ClothExportWindow : EditorWindow
    {
        readonly FigureChoice choice = new FigureChoice();
        string material = "";
        float arealMass = 0.2f;
        float backstopRadius;
        string result = "";
        bool failed;

        [MenuItem("GameObject/ClothStream/Export Cloth...", false, 30)]
        static void Open()
        {
            var window = GetWindow<ClothExportWindow>("Export Cloth");
            GameObject selected = Selection.activeGameObject;
            if (selected != null) window.choice.cloth = selected.GetComponent<SkinnedMeshRenderer>();
        }

        void OnGUI()
        {
            choice.cloth = Field("Cloth", "Object with a SkinnedMeshRenderer and a Cloth", choice.cloth);
            choice.body = Field("Body", "Closed mesh with the same bones, with which the cloth collides. None: only capsules and spheres of the Cloth", choice.body);
            choice.clip = Field("Animation", "Clip that moves the bones. None: they rest as the mesh was bound", choice.clip);
            choice.framesPerSecond = EditorGUILayout.FloatField(new GUIContent("Frames per second", "Of the animation, 1 to 1000"), choice.framesPerSecond);
            material = EditorGUILayout.TextField(new GUIContent("Material", "Of ClothStream, such as cotton, instead of stiffness, damping and friction of the Cloth. Empty: none"), material);
            arealMass = EditorGUILayout.FloatField(new GUIContent("Mass per area", "kg/m^2, 0.0001 to 1000, without a material"), arealMass);
            backstopRadius = EditorGUILayout.FloatField(new GUIContent("Backstop radius", "Metres, up to 1000. 0: ten mean edges of the cloth"), backstopRadius);
            if (GUILayout.Button("Export...")) Export();
            if (result != "") EditorGUILayout.HelpBox(result, failed ? MessageType.Error : MessageType.Info);
        }

        static T Field<T>(string label, string tooltip, T value) where T : Object
        {
            return (T)EditorGUILayout.ObjectField(new GUIContent(label, tooltip), value, typeof(T), true);
        }

        void Export()
        {
            failed = true;
            try
            {
                ExportedScene scene = ClothScene.Export(FigureReader.Read(choice), new ExportOptions { Material = material.Trim(), ArealMass = arealMass, BackstopRadius = backstopRadius });
                string path = EditorUtility.SaveFilePanel("Export Cloth", "", choice.cloth.name + ".json", "json");
                if (path == "") return;
                File.WriteAllText(path, scene.Json);
                failed = false;
                result = "Written: " + path + "\n" + string.Join("\n", scene.Notes);
            }
            catch (ExportException error)
            {
                result = error.Message;
            }
            catch (IOException error)
            {
                result = "The file cannot be written: " + error.Message;
            }
        }
    }
}
