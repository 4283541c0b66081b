// What a run has to say: by severity, with one line for equal texts of several owners.
#include "sim/base/notes.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_notes {
namespace {

TEST(Notes, EqualTextsOfSeveralOwnersAreOneLine) {
  Notes notes;
  notes.tell("body 'a'", "torsion is off: nothing twists it");
  notes.warn("joint 'j'", "its friction has no effect");
  notes.tell("body 'b'", "torsion is off: nothing twists it");
  notes.tell("", "event at t = 1 s");
  notes.tell("body 'c'", "torsion is off: nothing twists it");
  notes.tell("joint 'j'", "torsion is off: nothing twists it");
  notes.tell("body 'c'", "torsion is off: nothing twists it");
  const std::vector<std::string> told = notes.texts(Severity::note);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0], "body 'a', 'b', 'c' and joint 'j': torsion is off: nothing twists it");
  EXPECT_EQ(told[1], "event at t = 1 s");
  EXPECT_EQ(notes.texts(Severity::warning), std::vector<std::string>{"joint 'j': its friction has no effect"});
}

TEST(Notes, SeverityIsNoPartOfTheText) {
  Notes notes;
  notes.tell("", "WARNING in capitals is still a note");
  EXPECT_FALSE(notes.has(Severity::warning));
  notes.warn("", "quiet words");
  EXPECT_TRUE(notes.has(Severity::warning));
}

}  // namespace
}  // namespace flexframe::sim::test_notes
