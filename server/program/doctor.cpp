// SPDX-License-Identifier: MIT
// `clothstream-server doctor`: what an operator should know before others use the server.
#include <chrono>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "server/doctor/acceptance.h"
#include "server/doctor/device.h"
#include "server/doctor/host.h"
#include "server/endpoint/listen/listen.h"
#include "server/program/addresses.h"
#include "server/program/commands.h"
#include "server/simulation/software_threads.h"

namespace clothstream::program {
namespace {

void add(doctor::Findings& all, doctor::Findings more) {
  for (doctor::Finding& finding : more) all.push_back(std::move(finding));
}

doctor::Findings checkHost(const ServeOptions& options) {
  doctor::Findings findings = {
      doctor::checkPort(options.network.host, options.network.port, "--port"),
      doctor::checkPort(options.network.host, options.network.grpcPort, "--grpc-port")};
  if (options.network.datagrams != DatagramUse::off)
    add(findings, doctor::checkDatagramPort(datagramOptions(options.network),
                                            options.network.datagrams == DatagramUse::required));
  if (options.metrics.port)
    findings.push_back(doctor::checkPort(options.metrics.host, *options.metrics.port, "--metrics-port"));
  if (!options.tls.certificate.empty())
    findings.push_back(
        doctor::checkCertificate(options.tls.certificate, options.tls.key, options.network.publicNames));
  if (!options.state.directory.empty())
    findings.push_back(doctor::checkDirectory(options.state.directory, "--state-dir", options.keepFreeMb));
  if (!options.record.directory.empty())
    findings.push_back(doctor::checkDirectory(options.record.directory,
                                              options.record.onRequest ? "--recordings" : "--record",
                                              options.keepFreeMb));
  findings.push_back(doctor::checkCongestionControl(endpoint::congestionControlOfPorts()));
  findings.push_back(doctor::checkClock());
  return findings;
}

void write(const std::filesystem::path& path, const nlohmann::ordered_json& report) {
  std::ofstream file(path);
  file << report.dump(1) << '\n';
  if (!file.flush()) throw std::runtime_error(fmt::format("--report: {} cannot be written", path.string()));
}

}  // namespace

int runDoctor(const ServeOptions& options, const DoctorOptions& command, const Signals& signals) {
  doctor::Findings findings;
  bool interrupted = false;
  // Findings appear as they come, because some take long.
  const auto tell = [&](doctor::Findings more) {
    if (!command.json) fmt::print("{}", doctor::toText(more));
    std::fflush(stdout);
    add(findings, std::move(more));
  };
  tell(checkHost(options));
  const auto optionsFor = [&](std::uint32_t nodes) {
    return simulation::suitedTo(nodes, options.server.device);
  };
  tell(doctor::checkDevices(optionsFor(0)));
  if (!doctor::hasProblem(findings) && command.seconds > 0) {
    tell(doctor::measureCapacity(optionsFor, std::chrono::duration<double>(command.seconds)));
    tell(doctor::estimateCrowds(optionsFor));
  }
  if (command.accepts)
    for (const doctor::AcceptedState& expected : doctor::acceptedStates()) {
      const auto stop = [&] { return interrupted = interrupted || signals.interrupted(); };
      try {
        tell({doctor::accept(optionsFor, expected, stop)});
      } catch (const std::exception& error) {
        if (interrupted) break;
        tell({{.level = doctor::Level::problem,
               .topic = "acceptance",
               .text = fmt::format("{}: {}", expected.scene, error.what())}});
      }
    }
  const nlohmann::ordered_json report{{"server", kServerName}, {"findings", doctor::toJson(findings)}};
  if (command.json) fmt::print("{}\n", report.dump(1));
  if (!command.report.empty()) write(command.report, report);
  if (interrupted) return kInterrupted;
  return doctor::hasProblem(findings) ? 1 : 0;
}

}  // namespace clothstream::program
