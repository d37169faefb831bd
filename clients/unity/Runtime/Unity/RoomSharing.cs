// SPDX-License-Identifier: MIT
// Who gets the shape of the user's room.
namespace ClothStream
{
    /// <summary>Consent of the user to send the shape of the real room.</summary>
    public enum RoomSharing
    {
        /// <summary>It stays on this device, and cloth passes through the furniture.</summary>
        NoOne,
        /// <summary>The server gets it, uses it for the cloth, and sends it to no one.</summary>
        Server,
        /// <summary>If the server sends it to everyone in the scene, they may get it too.</summary>
        Everyone
    }
}
