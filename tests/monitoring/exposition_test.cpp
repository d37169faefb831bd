// SPDX-License-Identifier: MIT
// The reader of the tests refuses text that Prometheus, or our own rules, would not accept.
#include "tests/monitoring/exposition.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace clothstream::tests {
namespace {

const std::string kCounter = "# HELP clothstream_x_total Help.\n# TYPE clothstream_x_total counter\n";
const std::string kHistogram = "# HELP clothstream_x_seconds Help.\n# TYPE clothstream_x_seconds histogram\n";

std::string histogram(const std::string& sum, const std::string& first, const std::string& last) {
  return kHistogram + "clothstream_x_seconds_count 3\nclothstream_x_seconds_sum " + sum +
         "\nclothstream_x_seconds_bucket{le=\"0.1\"} " + first +
         "\nclothstream_x_seconds_bucket{le=\"+Inf\"} " + last + "\n";
}

TEST(Exposition, ReadsSamplesAndUnescapesLabels) {
  const Exposition read(kCounter + "clothstream_x_total{scene=\"a\\\"b\\\\c\\nd\"} 1.5e+3\n" +
                        histogram("0.5", "2", "3"));
  EXPECT_EQ(read.value("clothstream_x_total", {{"scene", "a\"b\\c\nd"}}), 1500);
  EXPECT_EQ(read.value("clothstream_x_seconds_bucket", {{"le", "0.1"}}), 2);
  EXPECT_EQ(read.families().at("clothstream_x_total").help, "Help.");
  EXPECT_TRUE(read.hasLabel("scene", "a\"b\\c\nd"));
  EXPECT_EQ(read.find("clothstream_x_total"), std::nullopt);
}

TEST(Exposition, RefusesTextThatIsNotStrict) {
  for (const std::string& text :
       {std::string("clothstream_x_total 1\n"), kCounter + "clothstream_x_total 1",
        kCounter + "clothstream_x_total one\n", kCounter + "clothstream_x_total -1\n",
        kCounter + "clothstream_x_total 1\nclothstream_x_total 2\n", kCounter + "clothstream_y_total 1\n",
        kCounter + "clothstream_x_total{a=\"1\",a=\"2\"} 1\n",
        kCounter + "clothstream_x_total{a=\"\\x\"} 1\n", kCounter + "clothstream_x_total{a=\"1} 1\n",
        kCounter + kCounter, std::string("# HELP clothstream_x_total Help.\nclothstream_x_total 1\n"),
        std::string("# HELP x_total Help.\n# TYPE x_total counter\n"),
        std::string("# HELP clothstream_x Help.\n# TYPE clothstream_x counter\n"),
        std::string("# HELP clothstream_x_total Help.\n# TYPE clothstream_x_total gauge\n"),
        std::string("# HELP clothstream_x_ms Help.\n# TYPE clothstream_x_ms gauge\n"),
        histogram("0.5", "4", "3"), histogram("0.5", "2", "2"), histogram("0.05", "2", "3"),
        kHistogram + "clothstream_x_seconds_count 3\nclothstream_x_seconds_sum 1\n"})
    EXPECT_THROW(Exposition{text}, std::runtime_error) << text;
}

}  // namespace
}  // namespace clothstream::tests
