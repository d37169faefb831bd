// SPDX-License-Identifier: MIT
// Stub of the part of UnityEditor that the package uses. A test answers the questions of the window.
using System;
using UnityEngine;

namespace UnityEngine
{
    public sealed class GUIContent
    {
        public readonly string text, tooltip;

        public GUIContent(string text, string tooltip)
        {
            this.text = text;
            this.tooltip = tooltip;
        }
    }

    public static class GUILayout
    {
        public static string Pressed = ""; // label of the button that a test presses

        public static bool Button(string text) { return text == Pressed; }
    }
}

namespace UnityEditor
{
    [AttributeUsage(AttributeTargets.Method)]
    public sealed class MenuItem : Attribute
    {
        public MenuItem(string itemName, bool isValidateFunction, int priority) { }
    }

    public class EditorWindow : UnityEngine.Object
    {
        public static T GetWindow<T>(string title) where T : EditorWindow, new() { return new T { name = title }; }
    }

    public enum MessageType { None, Info, Warning, Error }

    public static class EditorGUILayout
    {
        public static string Message = "";
        public static MessageType Type;

        public static UnityEngine.Object ObjectField(GUIContent label, UnityEngine.Object obj, Type objType, bool allowSceneObjects) { return obj; }
        public static float FloatField(GUIContent label, float value) { return value; }
        public static string TextField(GUIContent label, string text) { return text; }

        public static void HelpBox(string message, MessageType type)
        {
            Message = message;
            Type = type;
        }
    }

    public static class EditorUtility
    {
        public static string SavePath = "";

        public static string SaveFilePanel(string title, string directory, string defaultName, string extension) { return SavePath; }
    }

    public static class Selection
    {
        public static GameObject activeGameObject { get; set; }
    }

    // Unity restores all transforms when the mode ends; a test checks only that it ends.
    public static class AnimationMode
    {
        static bool isActive, isSampling;

        public static bool InAnimationMode() { return isActive; }
        public static void StartAnimationMode() { isActive = true; }
        public static void StopAnimationMode() { isActive = false; }
        public static void BeginSampling() { isSampling = isActive; }
        public static void EndSampling() { isSampling = false; }

        public static void SampleAnimationClip(GameObject gameObject, AnimationClip clip, float time)
        {
            if (!isSampling) throw new InvalidOperationException("the animation mode is not sampling");
            clip.Motion(gameObject, time);
        }
    }
}
