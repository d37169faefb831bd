// SPDX-License-Identifier: MIT
// Parameters and settings sent to the server. Changes, reports, notices and scenes received from it.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <google/protobuf/unknown_field_set.h>
#include <gtest/gtest.h>

#include "proto/parameters/cloth_parameters.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(Parameters, SendOnlyGivenValues) {
  JoinedClient joined;
  const float wind[] = {1, 0, -2};
  cs_set_environment(joined.client.get(), nullptr, wind, nullptr);
  const v1::ClientMessage message = joined.sent();
  EXPECT_NE(message.request_id(), 0u);
  const v1::ParameterChange& change = message.parameter_change();
  EXPECT_FALSE(change.has_gravity());
  EXPECT_FALSE(change.has_air_density());
  EXPECT_EQ(change.wind().value().z(), -2);

  cs_cloth_settings settings;
  cs_keep_cloth_settings(&settings);
  settings.bend[0] = 20;
  settings.bend[1] = 0.1f;
  settings.damping = 0.5f;
  ASSERT_EQ(cs_set_cloth(joined.client.get(), "curtain", &settings), 1);
  const v1::ParameterChange cloth = joined.sent().parameter_change();
  ASSERT_THAT(cloth.cloths(), SizeIs(1));
  EXPECT_EQ(cloth.cloths(0).name(), "curtain");
  EXPECT_FALSE(cloth.cloths(0).has_structural());
  EXPECT_EQ(cloth.cloths(0).bend().stiffness(), 20);
  EXPECT_EQ(cloth.cloths(0).bend().damping(), 0.1f);
  EXPECT_EQ(cloth.cloths(0).damping(), 0.5f);
  EXPECT_FALSE(cloth.cloths(0).has_friction());

  cs_collider_change sphere;
  cs_keep_collider(&sphere);
  sphere.radius = 0.3f;
  ASSERT_EQ(cs_set_collider(joined.client.get(), "ball", &sphere), 1);
  const v1::ParameterChange collider = joined.sent().parameter_change();
  ASSERT_THAT(collider.colliders(), SizeIs(1));
  EXPECT_EQ(collider.colliders(0).name(), "ball");
  EXPECT_FALSE(collider.colliders(0).has_position());
  EXPECT_EQ(collider.colliders(0).radius(), 0.3f);

  cs_set_areal_mass(joined.client.get(), "sheet", 0.25f);
  const v1::ParameterChange mass = joined.sent().parameter_change();
  ASSERT_THAT(mass.cloths(), SizeIs(1));
  EXPECT_EQ(mass.cloths(0).areal_mass(), 0.25f);
}

TEST(Parameters, ChangeOfColliderHasOnlyTheNumbersThatAreSet) {
  JoinedClient joined;
  cs_collider_change change;
  cs_keep_collider(&change);
  ASSERT_EQ(cs_set_collider(joined.client.get(), "box", &change), 1);
  v1::ColliderChange nothing;
  nothing.set_name("box");
  EXPECT_EQ(joined.sent().parameter_change().colliders(0).SerializeAsString(), nothing.SerializeAsString());

  std::ranges::copy(std::array{1.f, 2.f, 3.f}, change.position);
  std::ranges::copy(std::array{0.f, 0.6f, 0.f, 0.8f}, change.orientation);
  std::ranges::copy(std::array{0.1f, 0.2f, 0.3f}, change.size);
  change.radius = 0.5f;
  change.length = 0.7f;
  change.friction = 0;
  ASSERT_EQ(cs_set_collider(joined.client.get(), "box", &change), 1);
  const v1::ColliderChange all = joined.sent().parameter_change().colliders(0);
  EXPECT_EQ(all.position().z(), 3);
  EXPECT_EQ(all.orientation().y(), 0.6f);
  EXPECT_EQ(all.orientation().w(), 0.8f);
  EXPECT_EQ(all.size().x(), 0.1f);
  EXPECT_EQ(all.radius(), 0.5f);
  EXPECT_EQ(all.length(), 0.7f);
  EXPECT_TRUE(all.has_friction());
  EXPECT_EQ(all.friction(), 0);

  change.version = CS_COLLIDER_CHANGE_VERSION + 1;
  EXPECT_EQ(cs_set_collider(joined.client.get(), "box", &change), 0);
}

TEST(Parameters, FollowTheDescriptionAndLaterChanges) {
  JoinedClient joined;
  cs_environment environment;
  ASSERT_EQ(cs_get_environment(joined.client.get(), &environment), 1);
  EXPECT_EQ(environment.gravity[1], -9.81f);  // default, because the definition gives none
  EXPECT_EQ(environment.wind[0], 3);
  EXPECT_EQ(environment.air_density, 1.2f);
  cs_cloth_settings cloth;
  ASSERT_EQ(cs_get_cloth_settings(joined.client.get(), 0, &cloth), 1);
  EXPECT_EQ(cloth.structural[0], 100);
  EXPECT_EQ(cloth.damping, 0.25f);

  v1::ServerMessage message;
  v1::ParameterChange& change = *message.mutable_parameter_changed()->mutable_change();
  change.mutable_wind()->mutable_value()->set_z(-1);
  v1::ClothChange& everyCloth = *change.add_cloths();
  everyCloth.mutable_structural()->set_stiffness(50);
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()),
            static_cast<std::uint32_t>(CS_EVENT_PARAMETERS));
  cs_get_environment(joined.client.get(), &environment);
  EXPECT_EQ(environment.wind[0], 0);
  EXPECT_EQ(environment.wind[2], -1);
  EXPECT_EQ(environment.air_density, 1.2f);
  cs_get_cloth_settings(joined.client.get(), 0, &cloth);
  EXPECT_EQ(cloth.structural[0], 50);
  EXPECT_EQ(cloth.damping, 0.25f);
}

TEST(Parameters, FillWhatFieldsLeaveOut) {
  JoinedClient joined;
  v1::ServerMessage message;
  v1::ParameterChange& change = *message.mutable_parameter_changed()->mutable_change();
  change.mutable_gravity();
  change.mutable_gust()->set_strength(3);
  joined.client.receive(message.SerializeAsString());
  cs_environment environment;
  cs_get_environment(joined.client.get(), &environment);
  EXPECT_EQ(environment.gravity[1], 0);
  EXPECT_EQ(environment.gust_strength, 3);
  EXPECT_EQ(environment.gust_seconds, 2);
}

TEST(Parameters, IncludeGustsAndMaterials) {
  ScriptedServer server;
  v1::StreamDescription description = server.description();
  description.add_materials("cotton");
  description.add_materials("denim");
  description.mutable_definition()->mutable_cloths(0)->set_material("denim");
  description.mutable_definition()->mutable_environment()->mutable_gust()->set_strength(1.5f);
  description.mutable_definition()->mutable_environment()->mutable_gust()->set_seconds(4);
  ClientUnderTest client;
  EXPECT_EQ(cs_material_count(client.get()), 0u);
  client.receive(server.welcome());
  client.receiveAll(chunksOf(description.SerializeAsString(), 1 << 18, 1));
  client.outgoing();
  ASSERT_EQ(cs_material_count(client.get()), 2u);
  EXPECT_STREQ(cs_material(client.get(), 1), "denim");
  EXPECT_STREQ(cs_material(client.get(), 2), "");
  EXPECT_STREQ(cs_cloth_material(client.get(), 0), "denim");
  EXPECT_STREQ(cs_cloth_material(client.get(), 9), "");
  cs_environment environment;
  cs_get_environment(client.get(), &environment);
  EXPECT_EQ(environment.gust_strength, 1.5f);
  EXPECT_EQ(environment.gust_seconds, 4);

  cs_set_material(client.get(), "curtain", "cotton");
  cs_set_gust(client.get(), 2, 0.5f);
  const auto sent = client.outgoing();
  ASSERT_THAT(sent, SizeIs(2));
  EXPECT_EQ(sent[0].parameter_change().cloths(0).name(), "curtain");
  EXPECT_EQ(sent[0].parameter_change().cloths(0).material(), "cotton");
  EXPECT_EQ(sent[1].parameter_change().gust().strength(), 2);
  EXPECT_EQ(sent[1].parameter_change().gust().seconds(), 0.5f);

  v1::ServerMessage message;
  v1::ParameterChange& change = *message.mutable_parameter_changed()->mutable_change();
  change.mutable_gust()->set_strength(3);
  change.mutable_gust()->set_seconds(1);
  change.add_cloths()->set_material("cotton");
  client.receive(message.SerializeAsString());
  cs_get_environment(client.get(), &environment);
  EXPECT_EQ(environment.gust_strength, 3);
  EXPECT_STREQ(cs_cloth_material(client.get(), 0), "cotton");

  // An empty name clears the material. An absent name would keep it.
  change.mutable_cloths(0)->set_material("");
  client.receive(message.SerializeAsString());
  EXPECT_STREQ(cs_cloth_material(client.get(), 0), "");
}

TEST(Parameters, AreAbsentBeforeTheDescription) {
  ClientUnderTest client;
  cs_environment environment;
  cs_cloth_settings cloth;
  EXPECT_EQ(cs_get_environment(client.get(), &environment), 0);
  EXPECT_EQ(cs_get_cloth_settings(client.get(), 0, &cloth), 0);
  EXPECT_EQ(cs_vertex_count(client.get()), 0u);
}

TEST(ClothSettings, ShowCurrentValuesAndChangeOnlyGivenOnes) {
  ScriptedServer server;
  v1::StreamDescription description = server.description();
  v1::Cloth& definition = *description.mutable_definition()->mutable_cloths(0);
  definition.set_friction(0.5f);
  definition.set_thickness(0.02f);
  definition.mutable_solver()->mutable_acad()->set_activation(0.25f);
  definition.mutable_solver()->mutable_acad()->set_mode(v1::ACAD_MODE_PAPER);
  definition.mutable_solver()->mutable_acad()->mutable_constraint()->set_iterations(7);
  definition.mutable_solver()->mutable_acad()->mutable_constraint()->set_tolerance(0.5f);
  ClientUnderTest client;
  client.receive(server.welcome());
  client.receiveAll(chunksOf(description.SerializeAsString(), 1 << 18, 1));
  client.outgoing();

  cs_cloth_settings now{};
  ASSERT_EQ(cs_get_cloth_settings(client.get(), 0, &now), 1);
  EXPECT_EQ(now.structural[0], 100);
  EXPECT_EQ(now.friction, 0.5f);
  EXPECT_EQ(now.thickness, 0.02f);
  EXPECT_EQ(now.solver, static_cast<std::uint32_t>(CS_SOLVER_ACAD));
  EXPECT_EQ(now.activation, 0.25f);
  EXPECT_EQ(now.iterations, 7u);
  EXPECT_TRUE(std::isnan(now.compliance));
  EXPECT_EQ(cs_get_cloth_settings(client.get(), 1, &now), 0);
  now.version = 99;
  EXPECT_EQ(cs_get_cloth_settings(client.get(), 0, &now), 0);

  const auto sent = [&] {
    const auto messages = client.outgoing();
    EXPECT_THAT(messages, SizeIs(1));
    return messages.empty() ? v1::ClothChange() : messages[0].parameter_change().cloths(0);
  };
  cs_cloth_settings change;
  cs_keep_cloth_settings(&change);
  change.structural[0] = 50;
  change.lift = 0.125f;
  ASSERT_EQ(cs_set_cloth(client.get(), "", &change), 1);
  const v1::ClothChange springs = sent();
  EXPECT_EQ(springs.name(), "curtain");
  EXPECT_EQ(springs.structural().stiffness(), 50);
  EXPECT_EQ(springs.structural().damping(), 0.5f);  // does not change
  EXPECT_EQ(springs.lift(), 0.125f);
  EXPECT_FALSE(springs.has_shear() || springs.has_damping() || springs.has_thickness() ||
               springs.has_solver());

  cs_keep_cloth_settings(&change);
  change.iterations = 30;
  cs_set_cloth(client.get(), "curtain", &change);
  const v1::Solver solver = sent().solver();
  EXPECT_EQ(solver.acad().activation(), 0.25f);
  EXPECT_EQ(solver.acad().mode(), v1::ACAD_MODE_PAPER);  // does not change
  EXPECT_EQ(solver.acad().constraint().iterations(), 30u);
  EXPECT_EQ(solver.acad().constraint().tolerance(), 0.5f);
  EXPECT_FALSE(solver.acad().constraint().has_compliance());

  EXPECT_EQ(cs_set_cloth(client.get(), "rug", &change), 0);
  change.version = 99;
  EXPECT_EQ(cs_set_cloth(client.get(), "", &change), 0);
  EXPECT_THAT(client.outgoing(), SizeIs(0));
}

TEST(ClothSettings, IncludeBendingSelfCollisionTethersAndPath) {
  ScriptedServer server;
  v1::StreamDescription description = server.description();
  v1::Cloth& definition = *description.mutable_definition()->mutable_cloths(0);
  definition.set_dihedral_bending(0.5f);
  definition.set_pressure(500);
  definition.mutable_self_collision()->set_radius(0.25f);
  definition.mutable_self_collision()->set_friction(0.75f);
  v1::ConstraintSolver& solver = *definition.mutable_solver()->mutable_constraint();
  solver.set_path(v1::CONSTRAINT_PATH_ASSEMBLED);
  ClientUnderTest client;
  client.receive(server.welcome());
  client.receiveAll(chunksOf(description.SerializeAsString(), 1 << 18, 1));
  client.outgoing();
  cs_cloth_settings now{};
  ASSERT_EQ(cs_get_cloth_settings(client.get(), 0, &now), 1);
  EXPECT_EQ(now.dihedral_bending, 0.5f);
  EXPECT_EQ(now.pressure, 500);
  EXPECT_EQ(now.ball_radius, 0.25f);
  EXPECT_EQ(now.ball_friction, 0.75f);
  EXPECT_TRUE(std::isnan(now.tether_slack));
  EXPECT_EQ(now.assembled, 1);

  cs_cloth_settings change;
  cs_keep_cloth_settings(&change);
  change.dihedral_bending = 0.125f;
  change.pressure = 250;
  change.ball_friction = 0.5f;
  change.tether_slack = 0.0625f;
  change.iterations = 30;
  ASSERT_EQ(cs_set_cloth(client.get(), "", &change), 1);
  const auto messages = client.outgoing();
  ASSERT_THAT(messages, SizeIs(1));
  const v1::ClothChange& sent = messages[0].parameter_change().cloths(0);
  EXPECT_EQ(sent.dihedral_bending(), 0.125f);
  EXPECT_FALSE(sent.self_collision().has_radius());
  EXPECT_EQ(sent.self_collision().friction(), 0.5f);
  EXPECT_EQ(sent.tethers().slack(), 0.0625f);
  // The path does not change.
  EXPECT_EQ(sent.solver().constraint().path(), v1::CONSTRAINT_PATH_ASSEMBLED);

  v1::ServerMessage changed;
  *changed.mutable_parameter_changed()->mutable_change()->add_cloths() = sent;
  client.receive(changed.SerializeAsString());
  ASSERT_EQ(cs_get_cloth_settings(client.get(), 0, &now), 1);
  EXPECT_EQ(now.dihedral_bending, 0.125f);
  EXPECT_EQ(now.pressure, 250);
  EXPECT_EQ(now.ball_radius, 0.25f);
  EXPECT_EQ(now.ball_friction, 0.5f);
  EXPECT_EQ(now.tether_slack, 0.0625f);
  EXPECT_EQ(now.iterations, 30u);
}

TEST(ClothSettings, IncludeIterationsAndToleranceOfImplicitEuler) {
  ScriptedServer server;
  v1::StreamDescription description = server.description();
  v1::Solver& solver = *description.mutable_definition()->mutable_cloths(0)->mutable_solver();
  solver.mutable_implicit_euler()->set_iterations(9);
  solver.mutable_implicit_euler()->set_tolerance(0.25f);
  ClientUnderTest client;
  client.receive(server.welcome());
  client.receiveAll(chunksOf(description.SerializeAsString(), 1 << 18, 1));
  client.outgoing();
  cs_cloth_settings now{};
  ASSERT_EQ(cs_get_cloth_settings(client.get(), 0, &now), 1);
  EXPECT_EQ(now.solver, static_cast<std::uint32_t>(CS_SOLVER_IMPLICIT_EULER));
  EXPECT_EQ(now.iterations, 9u);
  EXPECT_EQ(now.tolerance, 0.25f);
  cs_cloth_settings change;
  cs_keep_cloth_settings(&change);
  change.iterations = 30;
  ASSERT_EQ(cs_set_cloth(client.get(), "", &change), 1);
  const auto messages = client.outgoing();
  ASSERT_THAT(messages, SizeIs(1));
  const v1::ImplicitEulerSolver& sent = messages[0].parameter_change().cloths(0).solver().implicit_euler();
  EXPECT_EQ(sent.iterations(), 30u);
  EXPECT_EQ(sent.tolerance(), 0.25f);
}

// Settings that the current solver does not have read as the values that keep them.
TEST(ClothSettings, OmitSettingsThatTheSolverDoesNotHave) {
  struct Row {
    cs_solver kind;
    bool iterations, tolerance, compliance, activation, bendConstraints, assembled;
  };
  for (const Row& row : {Row{CS_SOLVER_MASS_SPRING, false, false, false, false, false, false},
                         Row{CS_SOLVER_CONSTRAINT, true, true, true, false, true, true},
                         Row{CS_SOLVER_ACAD, true, true, true, true, true, false},
                         Row{CS_SOLVER_XPBD, true, false, true, false, false, false},
                         Row{CS_SOLVER_IMPLICIT_EULER, true, true, false, false, false, false}}) {
    SCOPED_TRACE(row.kind);
    v1::ServerMessage message;
    v1::Solver& solver =
        *message.mutable_parameter_changed()->mutable_change()->add_cloths()->mutable_solver();
    switch (row.kind) {
      case CS_SOLVER_CONSTRAINT:
        solver.mutable_constraint()->set_compliance(0.5f);
        break;
      case CS_SOLVER_ACAD:
        solver.mutable_acad()->mutable_constraint()->set_compliance(0.5f);
        break;
      case CS_SOLVER_XPBD:
        solver.mutable_xpbd()->set_compliance(0.5f);
        break;
      case CS_SOLVER_IMPLICIT_EULER:
        solver.mutable_implicit_euler();
        break;
      default:
        solver.mutable_mass_spring();
    }
    JoinedClient joined;
    joined.client.receive(message.SerializeAsString());
    cs_cloth_settings now{};
    ASSERT_EQ(cs_get_cloth_settings(joined.client.get(), 0, &now), 1);
    EXPECT_EQ(now.solver, static_cast<std::uint32_t>(row.kind));
    EXPECT_EQ(now.iterations != 0, row.iterations);
    EXPECT_EQ(!std::isnan(now.tolerance), row.tolerance);
    EXPECT_EQ(!std::isnan(now.compliance), row.compliance);
    EXPECT_EQ(!std::isnan(now.activation), row.activation);
    EXPECT_EQ(now.bend_constraints != -1, row.bendConstraints);
    EXPECT_EQ(now.assembled != -1, row.assembled);
  }
}

// Each number of the table is sent, and read back from the change that the server announces.
TEST(ClothSettings, CarryEveryNumberOfTheTable) {
  for (const parameters::ClothParameter& parameter : parameters::kClothParameters) {
    SCOPED_TRACE(std::string(parameter.option));
    JoinedClient joined;
    cs_cloth_settings change;
    cs_keep_cloth_settings(&change);
    settingOf(change, parameter.number) = 0.125f;
    ASSERT_EQ(cs_set_cloth(joined.client.get(), "", &change), 1);
    v1::ServerMessage changed;
    *changed.mutable_parameter_changed()->mutable_change() = joined.sent().parameter_change();

    const google::protobuf::Message* holder = &changed.parameter_changed().change().cloths(0);
    const auto field = [&](std::uint32_t number) {
      return holder->GetDescriptor()->FindFieldByNumber(static_cast<int>(number));
    };
    if (parameter.group != nullptr)
      holder = &holder->GetReflection()->GetMessage(*holder, field(parameter.group->field.inChange));
    EXPECT_EQ(holder->GetReflection()->GetFloat(*holder, field(parameter.field.inChange)), 0.125f);

    cs_cloth_settings now{};
    ASSERT_EQ(cs_get_cloth_settings(joined.client.get(), 0, &now), 1);
    const float before = settingOf(now, parameter.number);
    const bool isKept = parameter.group != nullptr && !parameter.group->isReplaced;
    // The cloth is a grid, which cannot hold gas, also if its server announces all numbers.
    const bool isGas = parameter.number == parameters::ClothNumber::pressure;
    EXPECT_EQ(std::isnan(before), isKept || isGas);
    joined.client.receive(changed.SerializeAsString());
    ASSERT_EQ(cs_get_cloth_settings(joined.client.get(), 0, &now), 1);
    if (isGas)
      EXPECT_TRUE(std::isnan(now.pressure));
    else
      EXPECT_EQ(settingOf(now, parameter.number), 0.125f);
  }
}

// A solver that is selected again keeps its previous settings, also if this client does not know its kind.
TEST(ClothSettings, KeepSettingsOfPreviousSolvers) {
  JoinedClient joined;
  const auto receive = [&](const v1::Solver& solver, std::uint64_t participant) {
    v1::ServerMessage message;
    message.mutable_parameter_changed()->set_participant_id(participant);
    *message.mutable_parameter_changed()->mutable_change()->add_cloths()->mutable_solver() = solver;
    EXPECT_EQ(joined.client.receive(message.SerializeAsString()),
              static_cast<std::uint32_t>(CS_EVENT_PARAMETERS));
  };
  v1::Solver constraint, unknown, massSpring;
  constraint.mutable_constraint()->set_iterations(9);
  constraint.mutable_constraint()->set_compliance(0.5f);
  massSpring.mutable_mass_spring();
  unknown.GetReflection()->MutableUnknownFields(&unknown)->AddLengthDelimited(9)->assign(
      "\x0d\x01\x02\x03\x04");
  receive(constraint, 42);
  EXPECT_EQ(cs_parameters_participant(joined.client.get()), cs_participant_id(joined.client.get()));
  receive(unknown, 3);
  EXPECT_EQ(cs_parameters_participant(joined.client.get()), 3u);
  cs_cloth_settings now{};
  ASSERT_EQ(cs_get_cloth_settings(joined.client.get(), 0, &now), 1);
  EXPECT_EQ(now.solver, 9u);
  receive(massSpring, 3);

  cs_cloth_settings change;
  cs_keep_cloth_settings(&change);
  change.solver = CS_SOLVER_CONSTRAINT;
  cs_set_cloth(joined.client.get(), "", &change);
  const v1::Solver back = joined.sent().parameter_change().cloths(0).solver();
  EXPECT_EQ(back.constraint().iterations(), 9u);
  EXPECT_EQ(back.constraint().compliance(), 0.5f);
  change.solver = 9;
  cs_set_cloth(joined.client.get(), "", &change);
  EXPECT_EQ(joined.sent().parameter_change().cloths(0).solver().SerializeAsString(),
            unknown.SerializeAsString());
}

TEST(Reports, AreAvailableWithTheirTick) {
  ScriptedServer server;
  ClientUnderTest client;
  client.join(server);
  cs_cloth_report report{};
  client.receive(server.frame(1, codec::PacketKind::key));
  EXPECT_EQ(cs_get_cloth_report(client.get(), 0, &report), 0);
  v1::Frame frame = server.frameMessage(5, codec::PacketKind::predicted);
  frame.mutable_report()->set_device_seconds(0.002);
  v1::ClothReport& cloth = *frame.mutable_report()->add_cloths();
  cloth.set_strain_max(0.5f);
  cloth.set_strain_p99(0.25f);
  cloth.set_strain_mean(0.125f);
  cloth.set_kinetic_energy(1);
  cloth.set_elastic_energy(2);
  cloth.set_gravity_energy(-3);
  cloth.set_active_constraints(40);
  cloth.set_iterations(6);
  cloth.set_residual(0.01f);
  cloth.set_penetration(0.003f);
  EXPECT_EQ(client.receive(ScriptedServer::serialise(frame)),
            static_cast<std::uint32_t>(CS_EVENT_FRAME | CS_EVENT_REPORT));
  // Frames without a report keep the previous one.
  EXPECT_EQ(client.receive(server.frame(6)), static_cast<std::uint32_t>(CS_EVENT_FRAME));
  ASSERT_EQ(cs_get_cloth_report(client.get(), 0, &report), 1);
  EXPECT_EQ(report.tick, 5u);
  EXPECT_EQ(report.strain_max, 0.5f);
  EXPECT_EQ(report.strain_p99, 0.25f);
  EXPECT_EQ(report.strain_mean, 0.125f);
  EXPECT_EQ(report.kinetic_energy, 1);
  EXPECT_EQ(report.elastic_energy, 2);
  EXPECT_EQ(report.gravity_energy, -3);
  EXPECT_EQ(report.active_constraints, 40u);
  EXPECT_EQ(report.iterations, 6u);
  EXPECT_EQ(report.residual, 0.01f);
  EXPECT_EQ(report.penetration, 0.003f);
  EXPECT_FLOAT_EQ(report.device_ms, 2);
  EXPECT_EQ(cs_get_cloth_report(client.get(), 1, &report), 0);
  report.version = 0;
  EXPECT_EQ(cs_get_cloth_report(client.get(), 0, &report), 0);
}

TEST(Reports, NameConstraintsOnRequest) {
  JoinedClient joined;
  ScriptedServer server;
  ClientUnderTest& client = joined.client;
  cs_want_constraints(client.get(), 1, 1);
  EXPECT_TRUE(joined.sent().collider_poses().active_constraints());
  v1::Frame frame = server.frameMessage(1, codec::PacketKind::key);
  std::uint32_t count = 7;
  v1::ClothReport& cloth = *frame.mutable_report()->add_cloths();
  for (const std::uint32_t end : {0u, 1u, 1u, 3u}) cloth.add_constraint_ends(end);
  client.receive(ScriptedServer::serialise(frame));
  const std::uint32_t* ends = cs_constraint_ends(client.get(), 0, &count);
  ASSERT_EQ(count, 2u);
  EXPECT_THAT(std::vector(ends, ends + 4), ::testing::ElementsAre(0, 1, 1, 3));
  // A report without names has none.
  frame = server.frameMessage(2, codec::PacketKind::predicted);
  frame.mutable_report()->add_cloths();
  client.receive(ScriptedServer::serialise(frame));
  EXPECT_EQ(cs_constraint_ends(client.get(), 0, &count), nullptr);
  EXPECT_EQ(count, 0u);
  count = 7;
  EXPECT_EQ(cs_constraint_ends(client.get(), 1, &count), nullptr);
  EXPECT_EQ(count, 0u);
  client.outgoing();
  cs_want_constraints(client.get(), 0, 1);
  EXPECT_FALSE(joined.sent().collider_poses().active_constraints());
}

// Half a constraint, a vertex that the cloth does not have, and more constraints than a report names.
TEST(Reports, WithConstraintsThatCannotBeEndTheClient) {
  std::vector<std::vector<std::uint32_t>> wrong = {{0}, {0, 1'000'000}, {}};
  wrong.back().resize(2 * 16'385);
  for (const std::vector<std::uint32_t>& ends : wrong) {
    ScriptedServer server;
    ClientUnderTest client;
    client.join(server);
    v1::Frame frame = server.frameMessage(1, codec::PacketKind::key);
    frame.mutable_report()->add_cloths()->mutable_constraint_ends()->Add(ends.begin(), ends.end());
    client.receive(ScriptedServer::serialise(frame));
    EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED) << ends.size();
  }
}

TEST(Reports, WithInvalidNumbersEndTheClient) {
  ScriptedServer server;
  ClientUnderTest client;
  client.join(server);
  v1::Frame frame = server.frameMessage(1, codec::PacketKind::key);
  frame.mutable_report()->add_cloths()->set_strain_max(std::numeric_limits<float>::quiet_NaN());
  client.receive(ScriptedServer::serialise(frame));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("SimulationReport"));
}

TEST(Notices, AreAvailable) {
  JoinedClient joined;
  v1::ServerMessage message;
  message.mutable_notice()->set_text("simulated time runs slow");
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), static_cast<std::uint32_t>(CS_EVENT_NOTICE));
  EXPECT_STREQ(cs_notice_text(joined.client.get()), "simulated time runs slow");
}

TEST(Scenes, AreListedInsideTheStream) {
  JoinedClient joined;
  cs_list_scenes(joined.client.get());
  EXPECT_TRUE(joined.sent().has_list_scenes());
  v1::ServerMessage message;
  message.mutable_list_scenes()->add_scenes()->set_name("curtain");
  message.mutable_list_scenes()->add_scenes()->set_name("flag");
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), static_cast<std::uint32_t>(CS_EVENT_SCENES));
  ASSERT_EQ(cs_scene_count(joined.client.get()), 2u);
  cs_scene_summary scene;
  ASSERT_EQ(cs_get_scene(joined.client.get(), 1, &scene), 1);
  EXPECT_STREQ(scene.name, "flag");
  EXPECT_EQ(cs_get_scene(joined.client.get(), 2, &scene), 0);
}

}  // namespace
}  // namespace clothstream::client
