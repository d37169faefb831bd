// SPDX-License-Identifier: MIT
// Lists of events. The client's thread collects them, because the core keeps only those of the newest message.
using System.Collections.Generic;

namespace ClothStream.Core
{
    /// <summary>A collider began or ended to touch a cloth.</summary>
    public sealed class Contact
    {
        public ContactEventKind Kind;
        /// <summary>Of a participant's collider.</summary>
        public uint ColliderId;
        /// <summary>0 for a collider of the scene.</summary>
        public ulong ParticipantId;
        /// <summary>Name of the scene's collider.</summary>
        public string Collider;
        public string Cloth;
        /// <summary>N s; in the first tick if the contact began, over the whole contact if it ended.</summary>
        public float Impulse;
        /// <summary>Duration of the contact; 0 if it began.</summary>
        public float Seconds;
    }

    public sealed unsafe partial class Client
    {
        // Most events of a kind that wait. Older ones are dropped.
        const int MaxWaiting = 256;

        readonly List<GrabEvent> grabEvents = new List<GrabEvent>();
        readonly List<Contact> contacts = new List<Contact>();
        readonly List<PresenceChange> presence = new List<PresenceChange>();

        /// <summary>Returns the grab events of all participants since the last call, at most the newest 256.</summary>
        public GrabEvent[] TakeGrabEvents() { return Take(grabEvents); }
        /// <summary>Returns the contacts since the last call, at most the newest 256. See WantContacts.</summary>
        public Contact[] TakeContacts() { return Take(contacts); }
        /// <summary>Returns who joined, left or changed since the last call, at most the newest 256.</summary>
        public PresenceChange[] TakePresence() { return Take(presence); }

        /// <summary>Turns contacts on or off. Default: off.</summary>
        public void WantContacts(bool wants)
        {
            lock (Gate) Native.cs_want_contacts(Handle, wants ? 1 : 0, NowUs);
            Flush();
        }

        void Keep(Events news)
        {
            if ((news & Events.Grabs) != 0)
            {
                var grab = new GrabEvent { version = Native.CS_GRAB_EVENT_VERSION };
                for (uint i = 0; Native.cs_get_grab_event(Handle, i, &grab) != 0; ++i) Add(grabEvents, grab);
            }
            if ((news & Events.Contacts) != 0)
            {
                var contact = new ContactEvent { version = Native.CS_CONTACT_EVENT_VERSION };
                for (uint i = 0; Native.cs_get_contact_event(Handle, i, &contact) != 0; ++i)
                    Add(contacts, new Contact
                    {
                        Kind = (ContactEventKind)contact.kind, ColliderId = contact.colliderId, ParticipantId = contact.participantId,
                        Collider = Utf8.Text(contact.collider), Cloth = Utf8.Text(contact.cloth), Impulse = contact.impulse, Seconds = contact.seconds
                    });
            }
            var change = new Presence { version = Native.CS_PRESENCE_VERSION };
            var participant = new Participant { version = Native.CS_PARTICIPANT_VERSION };
            if ((news & Events.Presence) != 0 && Native.cs_get_presence(Handle, &change, &participant) != 0)
                Add(presence, new PresenceChange
                {
                    Kind = (PresenceKind)change.kind, Reason = (LeaveReason)change.reason, By = change.by, Person = new Person(participant)
                });
        }

        static void Add<T>(List<T> list, T item)
        {
            if (list.Count == MaxWaiting) list.RemoveAt(0);
            list.Add(item);
        }

        T[] Take<T>(List<T> list)
        {
            lock (Gate)
            {
                T[] taken = list.ToArray();
                list.Clear();
                return taken;
            }
        }
    }
}
