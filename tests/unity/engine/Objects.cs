// SPDX-License-Identifier: MIT
// Stub of the part of UnityEngine that the package uses: objects, components and their life cycle. Written from Unity's
// scripting reference. Scene.Frame takes the place of the player loop.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;
using System.Runtime.ExceptionServices;

namespace UnityEngine
{
    [AttributeUsage(AttributeTargets.Field)]
    public sealed class TooltipAttribute : Attribute
    {
        public TooltipAttribute(string tooltip) { }
    }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class RangeAttribute : Attribute
    {
        public RangeAttribute(float min, float max) { }
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class AddComponentMenu : Attribute
    {
        public AddComponentMenu(string menuName) { }
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class DefaultExecutionOrder : Attribute
    {
        public readonly int order;
        public DefaultExecutionOrder(int order) { this.order = order; }
    }

    public class Object
    {
        bool isDestroyed;

        public virtual string name { get; set; }

        // A destroyed object equals null.
        public static bool operator ==(Object a, Object b) { return IsGone(a) ? IsGone(b) : ReferenceEquals(a, b); }
        public static bool operator !=(Object a, Object b) { return !(a == b); }
        public override bool Equals(object other) { return this == other as Object; }
        public override int GetHashCode() { return base.GetHashCode(); }

        public static void Destroy(Object destroyed)
        {
            var gameObject = destroyed as GameObject;
            if (gameObject != null) gameObject.SetActive(false);
            if (gameObject != null) Scene.Objects.Remove(gameObject);
            destroyed.isDestroyed = true;
        }

        static bool IsGone(Object a) { return ReferenceEquals(a, null) || a.isDestroyed; }
    }

    public sealed class GameObject : Object
    {
        readonly List<Component> components = new List<Component>();
        bool activeSelf = true;

        public GameObject(string name, params Type[] components)
        {
            this.name = name;
            transform = (Transform)Add(typeof(Transform));
            Scene.Objects.Add(this);
            foreach (Type type in components) Add(type);
        }

        public Transform transform { get; }
        public bool activeInHierarchy { get { return activeSelf && (transform.parent == null || transform.parent.gameObject.activeInHierarchy); } }
        internal IEnumerable<Component> Components { get { return components; } }

        public T AddComponent<T>() where T : Component { return (T)Add(typeof(T)); }
        public T GetComponent<T>() where T : class { return components.OfType<T>().FirstOrDefault(); }

        public void SetActive(bool value)
        {
            activeSelf = value;
            foreach (GameObject one in Scene.Objects.ToArray())
                foreach (MonoBehaviour behaviour in one.Components.OfType<MonoBehaviour>().ToArray()) behaviour.Apply();
        }

        Component Add(Type type)
        {
            var component = (Component)Activator.CreateInstance(type, true);
            component.gameObject = this;
            components.Add(component);
            (component as MonoBehaviour)?.Apply();
            return component;
        }
    }

    public class Component : Object
    {
        public GameObject gameObject { get; internal set; }

        public override string name
        {
            get { return gameObject.name; }
            set { gameObject.name = value; }
        }

        public Transform transform { get { return gameObject.transform; } }
        public T GetComponent<T>() where T : class { return gameObject.GetComponent<T>(); }

        // Of active objects, without those that are inactive.
        public void GetComponentsInChildren<T>(List<T> results) where T : class
        {
            results.Clear();
            foreach (GameObject one in Scene.Objects)
            {
                Transform at = one.transform;
                while (at != null && at != transform) at = at.parent;
                T found = at != null && one.activeInHierarchy ? one.GetComponent<T>() : null;
                if (found != null) results.Add(found);
            }
        }

        public T GetComponentInParent<T>() where T : class
        {
            for (Transform at = transform; at != null; at = at.parent)
            {
                var found = at.gameObject.GetComponent<T>();
                if (found != null) return found;
            }
            return null;
        }
    }

    public class Behaviour : Component
    {
        bool isEnabled = true;

        public bool enabled
        {
            get { return isEnabled; }
            set
            {
                isEnabled = value;
                (this as MonoBehaviour)?.Apply();
            }
        }

        public bool isActiveAndEnabled { get { return enabled && gameObject.activeInHierarchy; } }
    }

    public class MonoBehaviour : Behaviour
    {
        bool wasEnabled, hasStarted;

        // Calls OnEnable or OnDisable if the state has changed.
        internal void Apply()
        {
            if (isActiveAndEnabled == wasEnabled) return;
            wasEnabled = isActiveAndEnabled;
            Call(wasEnabled ? "OnEnable" : "OnDisable");
        }

        internal void Call(string message)
        {
            if (message == "Update" && !hasStarted)
            {
                hasStarted = true;
                Call("Start");
            }
            MethodInfo method = GetType().GetMethod(message, BindingFlags.Instance | BindingFlags.NonPublic | BindingFlags.Public | BindingFlags.DeclaredOnly);
            if (method == null) return;
            try { method.Invoke(this, null); }
            catch (TargetInvocationException error) { ExceptionDispatchInfo.Capture(error.InnerException).Throw(); }
        }

        internal int Order
        {
            get
            {
                var attribute = (DefaultExecutionOrder)Attribute.GetCustomAttribute(GetType(), typeof(DefaultExecutionOrder));
                return attribute == null ? 0 : attribute.order;
            }
        }
    }

    public static class Scene
    {
        public static readonly List<GameObject> Objects = new List<GameObject>();

        // Calls one message of all enabled behaviours.
        public static void Call(string message)
        {
            IEnumerable<MonoBehaviour> behaviours = Objects.SelectMany(one => one.Components).OfType<MonoBehaviour>().Where(one => one.isActiveAndEnabled).OrderBy(one => one.Order);
            foreach (MonoBehaviour behaviour in behaviours.ToArray())
                if (behaviour.isActiveAndEnabled) behaviour.Call(message);
        }

        public static T Find<T>() where T : Component
        {
            return Objects.SelectMany(one => one.Components).OfType<T>().FirstOrDefault();
        }

        public static void Frame()
        {
            Call("Update");
            Call("LateUpdate");
        }
    }

    public static class Debug
    {
        public static readonly List<string> Lines = new List<string>();

        public static void Log(object message) { Lines.Add("log " + message); }
        public static void LogWarning(object message, Object context) { Lines.Add("warning " + message); }
        public static void LogError(object message, Object context) { Lines.Add("error " + message); }
    }

    public sealed class Camera : Behaviour
    {
        public static Camera main;
    }
}
