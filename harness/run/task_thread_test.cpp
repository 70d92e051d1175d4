#include "harness/run/task_thread.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace nullmark {
namespace {

TEST(Background, CarriesOutAllTasksAsTheyCome) {
  std::vector<int> done;
  Background background;
  for (int i = 0; i < 100; ++i) background.add([&done, i] { done.push_back(i); });
  background.finish();
  ASSERT_EQ(done.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
}

TEST(Background, StopsAtATaskThatThrowsAndTellsOfIt) {
  bool after = false;
  Background background;
  background.add([] { throw std::runtime_error("disk full"); });
  background.add([&] { after = true; });
  EXPECT_THROW(background.finish(), std::runtime_error);
  EXPECT_TRUE(background.failed());
  EXPECT_FALSE(after);
}

}  // namespace
}  // namespace nullmark
