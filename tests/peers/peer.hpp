// What the C++ peers share: their arguments, the cloud, and the normals as files (weights/validate/real_peer.h).
#ifndef GNP_TESTS_PEER_HPP
#define GNP_TESTS_PEER_HPP

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

struct Peer {
	std::string method, out;
	std::vector<int> sizes;              // neighbours, the point itself included
	std::vector<double> points;          // (n, 3), their mean at 0
	std::vector<std::uint32_t> centres;
	std::vector<double> normals;         // (sizes, centres, 3), NaN to begin with
	std::chrono::steady_clock::time_point begun;
};

template <class T> std::vector<T> peer_read(const char *path)
{
	std::ifstream file(path, std::ios::binary);
	std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
	std::vector<T> values(bytes.size() / sizeof(T));
	if (!file || values.empty()) {
		std::fprintf(stderr, "%s: cannot be read\n", path);
		std::exit(1);
	}
	std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
	return values;
}

inline Peer peer_begin(int argc, char **argv)
{
	if (argc != 6) {
		std::fprintf(stderr, "usage: %s METHOD K[,K...] CLOUD CENTRES NORMALS\n", argv[0]);
		std::exit(2);
	}
	Peer peer;
	peer.method = argv[1];
	for (const char *at = argv[2]; at; at = std::strchr(at, ',') ? std::strchr(at, ',') + 1 : nullptr)
		peer.sizes.push_back(std::atoi(at));
	peer.points = peer_read<double>(argv[3]);
	peer.centres = peer_read<std::uint32_t>(argv[4]);
	peer.out = argv[5];
	for (int c = 0; c < 3; c++) {
		double mean = 0;
		for (std::size_t i = c; i < peer.points.size(); i += 3)
			mean += peer.points[i] / (peer.points.size() / 3);
		for (std::size_t i = c; i < peer.points.size(); i += 3)
			peer.points[i] -= mean;
	}
	peer.normals.assign(peer.sizes.size() * peer.centres.size() * 3, std::numeric_limits<double>::quiet_NaN());
	peer.begun = std::chrono::steady_clock::now();
	return peer;
}

inline void peer_set(Peer &peer, std::size_t size, std::size_t centre, double x, double y, double z)
{
	double *normal = &peer.normals[3 * (size * peer.centres.size() + centre)];
	normal[0] = x;
	normal[1] = y;
	normal[2] = z;
}

inline int peer_end(const Peer &peer)
{
	std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - peer.begun;
	std::ofstream file(peer.out, std::ios::binary);
	file.write(reinterpret_cast<const char *>(peer.normals.data()), peer.normals.size() * sizeof(double));
	std::printf("%.6f\n", seconds.count());
	return file.good() ? 0 : 1;
}

#endif
