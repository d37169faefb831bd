// SPDX-License-Identifier: MIT
// Put this script on an empty object: its position is where the scene of the server has its origin.
using ClothStream;
using ClothStream.Core;
using UnityEngine;

public sealed class ClothInARoom : MonoBehaviour
{
    [Tooltip("HOST:PORT of the server. On a headset, use the address of the server's machine, with wss:// and its fingerprint.")]
    public string address = "127.0.0.1:8080";
    [Tooltip("With wss://: what the server prints as its key.")]
    public string fingerprint = "";
    [Tooltip("A material that renders both faces.")]
    public Material material;
    [Tooltip("Camera offset of the XR Origin.")]
    public Transform trackingOrigin;

    void Start()
    {
        // Components read their fields when they are enabled, so the object is inactive until they are set.
        var stream = new GameObject("Cloth stream");
        stream.SetActive(false);
        stream.transform.SetParent(transform, false);
        var connection = stream.AddComponent<ClothStreamConnection>();
        connection.address = address;
        connection.fingerprint = fingerprint;
        connection.displayName = "Unity";
        connection.Changed += news => Report(connection, news);
        stream.AddComponent<StreamedCloth>().materials = material == null ? new Material[0] : new[] { material };
        var input = stream.AddComponent<ClothStreamInput>();
        input.trackingOrigin = trackingOrigin;
        if (Camera.main != null) input.head = Camera.main.transform;
        stream.SetActive(true);
    }

    static void Report(ClothStreamConnection connection, Events news)
    {
        if ((news & Events.Description) != 0) Debug.Log("Joined " + connection.Client.SceneName + " with " + connection.Client.VertexCount + " vertices");
        foreach (GrabEvent grab in connection.Client.TakeGrabEvents()) Debug.Log("Grab " + grab.grabId + ": " + (GrabEventKind)grab.kind);
    }
}
