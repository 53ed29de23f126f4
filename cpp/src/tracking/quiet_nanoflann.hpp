#pragma once

#include "support/quiet_nanoflann.hpp"
