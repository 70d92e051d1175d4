#include "harness/run/task_thread.h"

#include <gtest/gtest.h>

#include <future>
#include <stdexcept>
#include <vector>

namespace nullmark {
namespace {

TEST(Background, CarriesOutAllTasksAsTheyCome) {
  std::vector<int> done;
  Background background([] {});
  for (int i = 0; i < 100; ++i) background.add([&done, i] { done.push_back(i); });
  background.finish();
  ASSERT_EQ(done.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
}

/// What waits while one task is under way is synced once.
TEST(Background, TellsOnceThatSeveralTasksAreDone) {
  std::vector<int> done;
  std::promise<void> first_may_end;
  Background background([&] { done.push_back(-1); });
  background.add([&] { first_may_end.get_future().wait(); });
  for (int i = 0; i < 3; ++i) background.add([&done, i] { done.push_back(i); });
  first_may_end.set_value();
  background.finish();
  EXPECT_EQ(done, (std::vector<int>{0, 1, 2, -1}));
}

TEST(Background, StopsAtATaskThatThrowsAndTellsOfIt) {
  bool after = false;
  Background background([] {});
  background.add([] { throw std::runtime_error("disk full"); });
  background.add([&] { after = true; });
  EXPECT_THROW(background.finish(), std::runtime_error);
  EXPECT_TRUE(background.failed());
  EXPECT_FALSE(after);
}

}  // namespace
}  // namespace nullmark
