#include <hooke/io/motion.hpp>
