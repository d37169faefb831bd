// SPDX-License-Identifier: MIT
// Turns a pinch of two fingers, or a trigger, into a grab.

namespace ClothStream.Core
{
    /// <summary>
    /// One grab of a hand or controller. It begins when the pinch is strong enough and a cloth is near, and ends when the pinch
    /// becomes weaker. The two limits differ, so that a trembling pinch does not let go.
    /// </summary>
    public sealed unsafe class PinchGrab
    {
        /// <summary>Strength, 0 to 1, at which a grab begins and ends.</summary>
        public float TakeAt = 0.8f, ReleaseAt = 0.5f;
        /// <summary>Distance (m) within which a cloth is grabbed. 0 to 1.</summary>
        public float Reach = 0.05f;

        // A new grab has a new id: the server takes hold for a new id.
        const uint IdsPerHand = 1 << 20;

        readonly uint firstId;
        uint taken;
        bool isPinched;
        Grab grab;
        ClothPoint place;

        /// <param name="number">Differs between the grabs of a client, 0 to 9.</param>
        public PinchGrab(uint number)
        {
            firstId = 1 + number * IdsPerHand;
        }

        public bool IsHolding { get; private set; }
        /// <summary>What to pass to Client.SetGrabs while IsHolding.</summary>
        public Grab Grab { get { return grab; } }
        /// <summary>Place at which the grab took hold, for Client.SetGrabs.</summary>
        public ClothPoint Place { get { return place; } }

        /// <summary>Takes the newest pose. Position (m) and orientation (quaternion) are those of the stream.</summary>
        /// <param name="strength">Of the pinch, 0 (open) to 1 (closed).</param>
        public void Update(Client client, float strength, float[] position, float[] orientation)
        {
            bool begins = !isPinched && strength >= TakeAt;
            isPinched = strength >= (isPinched ? ReleaseAt : TakeAt);
            ClothPoint near;
            if (!isPinched) IsHolding = false;
            else if (begins && client.TryFindNearest(position[0], position[1], position[2], Reach, out near)) Begin(near);
            if (!IsHolding) return;
            fixed (Grab* moved = &grab)
            {
                for (int i = 0; i < 3; ++i) moved->position[i] = position[i];
                for (int i = 0; i < 4; ++i) moved->orientation[i] = orientation[i];
            }
        }

        /// <summary>Lets go.</summary>
        public void Release()
        {
            isPinched = IsHolding = false;
        }

        void Begin(ClothPoint near)
        {
            IsHolding = true;
            place = near;
            grab = new Grab
            {
                id = firstId + taken++ % IdsPerHand, radius = float.NaN, reach = float.NaN, maxForce = float.NaN, slipDistance = float.NaN
            };
        }
    }
}
