// SPDX-License-Identifier: MIT
// Participants and roles.

namespace ClothStream.Core
{
    /// <summary>A participant.</summary>
    public sealed unsafe class Person
    {
        public readonly ulong Id;
        public readonly string Name, ClientName;
        public readonly Role Role;
        /// <summary>The connection is lost, and the server waits for a reconnect.</summary>
        public readonly bool IsAway;

        internal Person(Participant participant)
        {
            Id = participant.id;
            Name = Utf8.Text(participant.name);
            ClientName = Utf8.Text(participant.clientName);
            Role = (Role)participant.role;
            IsAway = participant.away != 0;
        }
    }

    /// <summary>A participant joined, left or changed.</summary>
    public sealed class PresenceChange
    {
        public PresenceKind Kind;
        /// <summary>Only if the participant left.</summary>
        public LeaveReason Reason;
        /// <summary>Participant who caused it; 0 for the participant itself or the server.</summary>
        public ulong By;
        public Person Person;
    }

    public sealed unsafe partial class Client
    {
        /// <summary>0 before the server has admitted this participant.</summary>
        public ulong ParticipantId { get { lock (Gate) return Native.cs_participant_id(Handle); } }
        public Role Role { get { lock (Gate) return (Role)Native.cs_get_role(Handle); } }

        /// <summary>Participants in the order in which they joined, this one included.</summary>
        public Person[] People
        {
            get
            {
                lock (Gate)
                {
                    var people = new Person[Native.cs_participant_count(Handle)];
                    for (uint i = 0; i < people.Length; ++i)
                    {
                        var participant = new Participant { version = Native.CS_PARTICIPANT_VERSION };
                        Native.cs_get_participant(Handle, i, &participant);
                        people[i] = new Person(participant);
                    }
                    return people;
                }
            }
        }

        /// <summary>For owners. Events.Presence or Events.Error follows.</summary>
        public void SetRole(ulong participant, Role role)
        {
            lock (Gate) Native.cs_set_role(Handle, participant, (uint)role);
            Flush();
        }

        /// <summary>For owners. Events.Presence or Events.Error follows.</summary>
        public void Remove(ulong participant)
        {
            lock (Gate) Native.cs_remove_participant(Handle, participant);
            Flush();
        }
    }
}
